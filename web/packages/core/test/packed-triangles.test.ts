import fc from 'fast-check';
import { MeshoptEncoder } from 'meshoptimizer';
import { beforeAll, describe, expect, test } from 'vitest';
import { FarfieldError, NearBuild } from '../src/index.js';
import { unpackTriangles } from '../src/packed-triangles.js';
import { makeGlb } from './glb-maker.js';

/** Packed by the library itself. */
function pack(indices: Uint32Array): Uint8Array {
  const bytes = new Uint8Array(indices.buffer, indices.byteOffset, indices.byteLength);
  return MeshoptEncoder.encodeGltfBuffer(bytes, indices.length, 4, 'TRIANGLES');
}

/** Triangles as words that are equal for the same corners in the same direction. */
function turned(indices: Uint32Array): string[] {
  return Array.from({ length: indices.length / 3 }, (_, t) => {
    const [a, b, c] = indices.subarray(3 * t, 3 * t + 3);
    return [`${a} ${b} ${c}`, `${b} ${c} ${a}`, `${c} ${a} ${b}`].sort()[0];
  });
}

/** Vertices that lie near one another in numbers, or anywhere. */
const corner = fc.oneof(fc.nat(20), fc.nat(400), fc.nat(2 ** 31));
const soup = fc
  .array(fc.tuple(corner, corner, corner), { maxLength: 200 })
  .map((triangles) => Uint32Array.from(triangles.flat()));
/** A grid of quads, as meshes mostly are. */
const grid = fc
  .tuple(fc.integer({ min: 1, max: 40 }), fc.integer({ min: 1, max: 40 }))
  .map(([m, n]) =>
    Uint32Array.from(
      Array.from({ length: m * n }, (_, square) => {
        const a = Math.floor(square / n) * (n + 1) + (square % n);
        return [a, a + 1, a + n + 1, a + n + 1, a + 1, a + n + 2];
      }).flat(),
    ),
  );

beforeAll(() => MeshoptEncoder.ready);

describe('unpackTriangles', () => {
  test('gives back what the library packed: the same triangles in the same order', () => {
    fc.assert(
      fc.property(fc.oneof(soup, grid), (indices) => {
        expect(turned(unpackTriangles(pack(indices), indices.length))).toEqual(turned(indices));
      }),
    );
  });

  test('damaged bytes are refused or give numbers, and never run on', () => {
    const whole = pack(Uint32Array.from({ length: 300 }, (_, n) => (n * 7919) % 101));
    expect(() => unpackTriangles(whole.subarray(0, whole.length - 1), 300)).toThrow(FarfieldError);
    expect(() => unpackTriangles(whole, 303)).toThrow(FarfieldError);
    expect(() => unpackTriangles(whole, 297)).toThrow(FarfieldError);
    expect(() => unpackTriangles(whole, 299)).toThrow(FarfieldError);
    expect(() => unpackTriangles(new Uint8Array(10), 0)).toThrow(FarfieldError);
    fc.assert(
      fc.property(fc.nat(whole.length - 1), fc.nat(255), (at, value) => {
        const bad = whole.slice();
        bad[at] = value;
        try {
          expect(unpackTriangles(bad, 300)).toHaveLength(300);
        } catch (error) {
          expect(error).toBeInstanceOf(FarfieldError);
        }
      }),
    );
  });
});

describe('a near block with packed triangles', () => {
  const indices = Uint32Array.from([0, 1, 2, 2, 1, 3, 3, 1, 4]);

  function block(change: object = {}): ArrayBuffer {
    const packed = pack(indices);
    const positions = Float32Array.from({ length: 15 }, (_, n) => n * n);
    const view = {
      buffer: 0,
      byteOffset: 60,
      byteLength: packed.length,
      byteStride: 2,
      count: 9,
      mode: 'TRIANGLES',
      ...change,
    };
    const primitives = [
      { attributes: { POSITION: 0 }, indices: 1 },
      { attributes: { POSITION: 0 }, indices: 2 },
    ];
    const scalar = { componentType: 5123, type: 'SCALAR' };
    return makeGlb(
      {
        extensionsRequired: ['EXT_meshopt_compression'],
        nodes: [{ mesh: 0 }],
        meshes: [{ primitives }],
        bufferViews: [
          { buffer: 0, byteLength: 60 },
          { buffer: 1, byteLength: 18, extensions: { EXT_meshopt_compression: view } },
        ],
        accessors: [
          { bufferView: 0, componentType: 5126, type: 'VEC3', count: 5 },
          { bufferView: 1, count: 6, ...scalar },
          { bufferView: 1, byteOffset: 12, count: 3, ...scalar },
        ],
      },
      [
        { data: positions, componentType: 5126, type: 'VEC3', count: 5 },
        { data: packed, componentType: 5121, type: 'SCALAR', count: packed.length },
      ],
    );
  }

  test('ranges count in it as in a plain one', () => {
    const near = new NearBuild([0, 0, 0]);
    near.add({ bytes: block(), ranges: [0, 1, 1, 1, 0, 1] });
    const [{ indices: drawn, positions }] = near.finish();
    const xs = [...drawn].map((vertex) => Math.sqrt(positions[3 * vertex]) / 3);
    expect(turned(Uint32Array.from(xs))).toEqual(['1 3 2', '1 4 3']);
  });

  test.each([
    ['another mode', { mode: 'ATTRIBUTES' }, 'packed in a way'],
    ['too few bytes', { byteLength: 9999 }, 'cut short'],
    ['too many indices', { count: 12 }, 'damaged'],
    ['too few indices', { count: 6, byteLength: 0 }, 'damaged'],
    ['indices of another width', { byteStride: 4 }, 'past its data'],
  ])('refuses %s', (_, change, says) => {
    const near = new NearBuild([0, 0, 0]);
    expect(() => near.add({ bytes: block(change), ranges: [1, 0, 1] })).toThrow(says);
  });
});
