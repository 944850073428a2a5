import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { cutChunks, readNpy } from '../src/full-model/index.js';

/** A NumPy file by hand. */
function npy(type: string, shape: string, data: ArrayBufferView, fortran = 'False'): ArrayBuffer {
  const text = `{'descr': '${type}', 'fortran_order': ${fortran}, 'shape': (${shape}), }`;
  const padded = text.padEnd(128 - 10 - 1) + '\n';
  const bytes = new Uint8Array(128 + data.byteLength);
  bytes.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, padded.length, 0]);
  bytes.set(new TextEncoder().encode(padded), 10);
  bytes.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), 128);
  return bytes.buffer;
}

describe('readNpy', () => {
  test('reads the kinds that scenes have', () => {
    const floats = readNpy(npy('<f4', '2, 3', Float32Array.of(1, 2, 3, 4, 5, 6.5)));
    expect(floats.shape).toEqual([2, 3]);
    expect([...floats.data]).toEqual([1, 2, 3, 4, 5, 6.5]);
    expect([...readNpy(npy('|i1', '2,', Int8Array.of(-127, 3))).data]).toEqual([-127, 3]);
    expect([...readNpy(npy('<u2', '2,', Uint16Array.of(65535, 3))).data]).toEqual([65535, 3]);
    expect([...readNpy(npy('<u4', '1, 1', Uint32Array.of(4e9))).data]).toEqual([4e9]);
  });

  test.each([
    ['another type', npy('<f8', '1,', Float64Array.of(1))],
    ['another order', npy('<f4', '1, 1', Float32Array.of(1), 'True')],
    ['a short file', npy('<f4', '9,', Float32Array.of(1))],
    ['no array', new TextEncoder().encode('not an array, whatever its name says').buffer],
  ])('%s is refused', (_, bytes) => {
    expect(() => readNpy(bytes)).toThrow(/not an array/);
  });
});

describe('cutChunks', () => {
  test('every triangle is drawn once, in its own batch and place, whatever the chunks', () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(fc.nat(30), fc.nat(30), fc.nat(30)), { minLength: 1, maxLength: 60 }),
        fc.integer({ min: 1, max: 80 }),
        fc.nat(59),
        (corners, wanted, cut) => {
          const positions = Float32Array.from({ length: 93 }, (_, n) => ((n * 37) % 101) - 50);
          const triangles = Uint32Array.from(corners.flat());
          const first = Math.min(cut, corners.length);
          const batches = [[[0, first]], [[first, corners.length - first]]] as const;
          const chunks = cutChunks({ positions, triangles, batches }, wanted);
          const drawn = chunks.flatMap(({ batch, vertices, indices }) => {
            expect(new Set(vertices).size).toBe(vertices.length);
            return Array.from({ length: indices.length / 3 }, (_, t) =>
              [batch, ...[0, 1, 2].map((c) => vertices[indices[3 * t + c]])].join(),
            );
          });
          const all = corners.map((triangle, n) => [n < first ? 0 : 1, ...triangle].join());
          expect(drawn.sort()).toEqual(all.sort());
          expect(chunks.length).toBeLessThanOrEqual(2 * Math.round(Math.sqrt(wanted)) ** 2 || 2);
        },
      ),
    );
  });

  test('large chunks get wide indices', () => {
    const positions = new Float32Array(3 * 70_000);
    const triangles = Uint32Array.from({ length: 69_999 }, (_, n) => n);
    const [chunk] = cutChunks({ positions, triangles, batches: [[[0, 23_333]]] }, 1);
    expect(chunk.indices).toBeInstanceOf(Uint32Array);
    expect(chunk.indices.at(-1)).toBe(69_998);
  });
});
