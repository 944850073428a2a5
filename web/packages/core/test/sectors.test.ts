import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { SECTORS, sortBySector, visibleRange, type Sectors } from '../src/index.js';

type Matrix = number[];

/** Triangles in all directions: some thin, some that reach round the vertical, some infinitely far. */
const triangle = fc
  .tuple(
    fc.double({ min: -Math.PI, max: Math.PI, noNaN: true }),
    fc.double({ min: -1.5, max: 1.5, noNaN: true }),
    fc.constantFrom(0, 0.001, 0.02, 0.1),
    fc.constantFrom(0.01, 0.1, 0.3, 2),
    fc.array(fc.double({ min: -1, max: 1, noNaN: true }), { minLength: 6, maxLength: 6 }),
  )
  .map(([azimuth, elevation, w, size, shifts]) =>
    [0, 1, 2].flatMap((n) => {
      const a = azimuth + size * shifts[2 * n];
      const e = elevation + size * shifts[2 * n + 1];
      const scale = n + 1;
      return [
        scale * Math.cos(a) * Math.cos(e),
        scale * Math.sin(e),
        scale * Math.sin(a) * Math.cos(e),
        scale * w,
      ];
    }),
  );
const scene = fc.array(triangle, { minLength: 1, maxLength: 60 }).map((triangles) => {
  const positions = Float32Array.from(triangles.flat());
  const indices = Uint32Array.from({ length: 3 * triangles.length }, (_, n) => n);
  return { positions, indices };
});

/** Columns of a camera's matrix: anywhere in the cell, looking anywhere, any field of view. */
const camera = fc
  .record({
    eye: fc.tuple(
      ...[0, 1, 2].map(() => fc.double({ min: -5, max: 5, noNaN: true })),
    ) as fc.Arbitrary<[number, number, number]>,
    yaw: fc.double({ min: -4, max: 4, noNaN: true }),
    pitch: fc.double({ min: -1.5, max: 1.5, noNaN: true }),
    fov: fc.double({ min: 0.3, max: 2, noNaN: true }),
    aspect: fc.double({ min: 0.4, max: 2.5, noNaN: true }),
  })
  .map(({ eye, yaw, pitch, fov, aspect }): Matrix => {
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    const right = [cy, 0, -sy];
    const up = [sy * sp, cp, cy * sp];
    const back = [sy * cp, -sp, cy * cp];
    const dot = (v: number[]): number => v[0] * eye[0] + v[1] * eye[1] + v[2] * eye[2];
    const f = 1 / Math.tan(fov / 2);
    const rows = [
      [...right.map((v) => (f / aspect) * v), (-f / aspect) * dot(right)],
      [...up.map((v) => f * v), -f * dot(up)],
      [0, 0, 0, 0],
      [...back.map((v) => -v), dot(back)],
    ];
    return [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column]));
  });

/** Whether a plane of the frustum has all three corners outside. */
function isOutside(positions: Float32Array, corners: ArrayLike<number>, matrix: Matrix): boolean {
  const clip = Array.from(corners, (vertex) =>
    [0, 1, 2, 3].map((row) =>
      [0, 1, 2, 3].reduce((sum, c) => sum + matrix[4 * c + row] * positions[4 * vertex + c], 0),
    ),
  );
  return [0, 1].some((axis) =>
    [1, -1].some((sign) => clip.every((point) => point[3] + sign * point[axis] < 0)),
  );
}

/** The numbers of the triangles in a range of the sorted list. */
function drawn({ indices }: Sectors, start: number, count: number): number[] {
  return Array.from({ length: count / 3 }, (_, n) => indices[start + 3 * n] / 3);
}

describe('sectors', () => {
  test('every triangle that a camera may see is drawn, and none twice', () => {
    fc.assert(
      fc.property(scene, camera, ({ positions, indices }, matrix) => {
        const sectors = sortBySector(positions, indices);
        const { start, count } = visibleRange(sectors, matrix);
        const shown = [...drawn(sectors, 0, sectors.wide), ...drawn(sectors, start, count)];
        expect(new Set(shown).size).toBe(shown.length);
        for (let t = 0; t < indices.length / 3; t++) {
          if (shown.includes(t)) continue;
          expect(isOutside(positions, indices.subarray(3 * t, 3 * t + 3), matrix)).toBe(true);
        }
      }),
      { numRuns: 300 },
    );
  });

  test('both rounds hold the same triangles, each sector in the order of the file', () => {
    fc.assert(
      fc.property(scene, ({ positions, indices }) => {
        const sectors = sortBySector(positions, indices);
        const { starts, wide } = sectors;
        const round = starts[SECTORS] - starts[0];
        expect(starts[0]).toBe(wide);
        expect(sectors.indices.length).toBe(wide + 2 * round);
        const first = drawn(sectors, wide, round);
        expect(drawn(sectors, wide + round, round)).toEqual(first);
        const all = [...drawn(sectors, 0, wide), ...first].sort((a, b) => a - b);
        expect(all).toEqual(Array.from({ length: indices.length / 3 }, (_, t) => t));
        for (let s = 0; s < SECTORS; s++) {
          const part = drawn(sectors, starts[s], starts[s + 1] - starts[s]);
          expect(part).toEqual([...part].sort((a, b) => a - b));
        }
      }),
    );
  });

  test('a camera with a field of 60 degrees draws less than half of what lies all around', () => {
    const around = Array.from({ length: 360 }, (_, n) =>
      [0, 1, 2].flatMap((corner) => {
        const angle = ((n + 0.3 * corner) * Math.PI) / 180;
        return [Math.cos(angle), 0.05 * corner, Math.sin(angle), 0.05];
      }),
    );
    const positions = Float32Array.from(around.flat());
    const sectors = sortBySector(
      positions,
      Uint32Array.from({ length: 1080 }, (_, n) => n),
    );
    expect(sectors.indices).toBeInstanceOf(Uint16Array);
    const f = Math.sqrt(3);
    const ahead = [f, 0, 0, 0, 0, f, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0];
    const { count } = visibleRange(sectors, ahead);
    expect(count).toBeGreaterThanOrEqual(180);
    expect(count).toBeLessThan(540);
    const nothing = [f, 0, 0, 0, 0, f, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1];
    expect(visibleRange(sectors, nothing).count).toBe(0);
  });

  test('more vertices than 16 bits can name are numbered with 32', () => {
    const { indices } = sortBySector(new Float32Array(4 * 65_537), new Uint32Array(3));
    expect(indices).toBeInstanceOf(Uint32Array);
  });
});
