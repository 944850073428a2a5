import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { findObjects, type Triangles, type Vec3 } from '../../src/index.js';

const OPTIONS = { nearField: 50, largest: 10, fewest: 1 };

/** Tetrahedra with vertices of their own for every face, as flat shading makes them. */
function tetrahedra(centres: readonly Vec3[], size: number): Triangles {
  const corners = [
    [1, 1, 1],
    [1, -1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
  ];
  const faces = [
    [0, 1, 2],
    [0, 3, 1],
    [0, 2, 3],
    [1, 3, 2],
  ];
  const positions: number[] = [];
  for (const [x, y, z] of centres) {
    for (const corner of faces.flat()) {
      const [a, b, c] = corners[corner];
      positions.push(x + size * a, y + size * b, z + size * c);
    }
  }
  return {
    positions: Float32Array.from(positions),
    indices: Uint32Array.from({ length: positions.length / 3 }, (_, n) => n),
  };
}

const triangleKeys = (indices: Uint32Array): string[] =>
  Array.from({ length: indices.length / 3 }, (_, n) =>
    [...indices.subarray(3 * n, 3 * n + 3)].join(),
  ).sort();

describe('findObjects', () => {
  test('triangles that share places are one, whatever their vertices', () => {
    const { objects } = findObjects(
      [
        tetrahedra(
          [
            [0, 0, 0],
            [9, 0, 0],
          ],
          1,
        ),
      ],
      OPTIONS,
    );
    expect(objects.map(({ triangles }) => triangles)).toEqual([4, 4]);
    expect(objects[1].bounds).toEqual({ min: [8, -1, -1], max: [10, 1, 1] });
  });

  test('boxes that share more than half are one object across batches, up to the largest size', () => {
    const trunk = tetrahedra([[0, 0, 0]], 1);
    const leaves = tetrahedra(
      [
        [0.8, 0, 0],
        [1.6, 0, 0],
        [20, 0, 0],
      ],
      1,
    );
    const { objects } = findObjects([trunk, leaves], OPTIONS);
    expect(objects.map(({ triangles }) => triangles)).toEqual([12, 4]);
    expect(objects[0].ranges.map(([batch, , count]) => [batch, count])).toEqual([
      [0, 12],
      [1, 24],
    ]);
    const small = findObjects([trunk, leaves], { ...OPTIONS, largest: 3 });
    expect(small.objects.map(({ triangles }) => triangles).sort()).toEqual([4, 4, 8]);
  });

  test('what reaches out of the near field, is too large or too simple stays', () => {
    const batch = tetrahedra(
      [
        [0, 0, 0],
        [49.5, 0, 0],
      ],
      1,
    );
    expect(findObjects([batch], OPTIONS).objects).toHaveLength(1);
    expect(findObjects([batch], { ...OPTIONS, largest: 1 }).objects).toHaveLength(0);
    expect(findObjects([batch], { ...OPTIONS, fewest: 5 }).objects).toHaveLength(0);
    expect(findObjects([], OPTIONS)).toEqual({ objects: [], batches: [] });
  });

  test('every triangle is kept, in the rest or in one range of the object that contains it', () => {
    const place = fc.tuple(
      ...[0, 1, 2].map(() => fc.double({ min: -60, max: 60, noNaN: true })),
    ) as unknown as fc.Arbitrary<Vec3>;
    fc.assert(
      fc.property(
        fc.array(fc.array(place, { maxLength: 12 }), { minLength: 1, maxLength: 3 }),
        (clouds) => {
          const batches = clouds.map((cloud) => tetrahedra(cloud, 3));
          const { objects, batches: sorted } = findObjects(batches, OPTIONS);
          batches.forEach(({ indices }, n) => {
            expect(triangleKeys(sorted[n].indices)).toEqual(triangleKeys(indices));
          });
          const covered = sorted.map(({ indices, rest }) => {
            const marks = new Uint8Array(indices.length);
            marks.fill(1, 0, rest);
            return marks;
          });
          for (const { bounds, ranges, triangles } of objects) {
            expect(ranges.reduce((sum, [, , count]) => sum + count, 0)).toBe(3 * triangles);
            for (const [batch, first, count] of ranges) {
              for (let n = first; n < first + count; n++) {
                covered[batch][n]++;
                const vertex = sorted[batch].indices[n];
                for (let axis = 0; axis < 3; axis++) {
                  const value = batches[batch].positions[3 * vertex + axis];
                  expect(value).toBeGreaterThanOrEqual(bounds.min[axis]);
                  expect(value).toBeLessThanOrEqual(bounds.max[axis]);
                }
              }
            }
          }
          for (const marks of covered) expect(marks.every((mark) => mark === 1)).toBe(true);
        },
      ),
    );
  });
});
