import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { Solid, buildSolid, type NearBatch, type Vec3 } from '../src/index.js';

type Triangle = readonly [Vec3, Vec3, Vec3];

const SIZE: Vec3 = [10, 6, 10];
const CENTRE: Vec3 = [100, 3, -50];

function batch(triangles: readonly Triangle[], alpha: 'opaque' | 'mask' = 'opaque'): NearBatch {
  const positions = triangles.flat().flatMap((p) => p.map((v, axis) => v - CENTRE[axis]));
  return {
    state: {
      map: undefined,
      emissiveMap: undefined,
      emissive: [0, 0, 0],
      alpha,
      cutoff: 0.5,
      doubleSided: false,
      unlit: false,
    },
    positions: Float32Array.from(positions),
    normals: new Int8Array(),
    uvs: new Float32Array(),
    colors: new Uint16Array(),
    indices: Uint32Array.from({ length: 3 * triangles.length }, (_, n) => n),
    owners: new Int32Array(0),
  };
}

const solidOf = (triangles: readonly Triangle[]): Solid =>
  new Solid(buildSolid([batch(triangles)], CENTRE, SIZE));

/** A point around the cell, in sixteenths of a metre so that single precision holds it. */
const point = fc
  .tuple(
    fc.integer({ min: -90, max: 90 }),
    fc.integer({ min: -40, max: 40 }),
    fc.integer({ min: -90, max: 90 }),
  )
  .map((p): Vec3 => [CENTRE[0] + p[0] / 16, CENTRE[1] + p[1] / 16, CENTRE[2] + p[2] / 16]);
const triangle: fc.Arbitrary<Triangle> = fc.tuple(point, point, point);

const minus = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const steepness = ([a, b, c]: Triangle): number => {
  const n = cross(minus(b, a), minus(c, a));
  return Math.abs(n[1]) / Math.hypot(...n);
};

/** A dense set of points of a triangle. */
function* samples([a, b, c]: Triangle, steps: number): Generator<Vec3> {
  for (let i = 0; i <= steps; i++) {
    for (let j = 0; i + j <= steps; j++) {
      const [s, t] = [i / steps, j / steps];
      yield [0, 1, 2].map(
        (axis) => a[axis] + s * (b[axis] - a[axis]) + t * (c[axis] - a[axis]),
      ) as unknown as Vec3;
    }
  }
}

const square = (a: Vec3, b: Vec3, c: Vec3, d: Vec3): Triangle[] => [
  [a, b, c],
  [a, c, d],
];

describe('Solid', () => {
  test('the ground is a point of a floor, and no floor point lies between it and the top', () => {
    fc.assert(
      fc.property(
        fc.array(triangle, { minLength: 1, maxLength: 12 }),
        fc.nat(11),
        fc.integer({ min: -60, max: 60 }),
        (triangles, pick, lift) => {
          const solid = solidOf(triangles);
          const floors = triangles.filter((t) => steepness(t) > 0.61);
          const near = triangles[pick % triangles.length];
          const top = CENTRE[1] + lift / 16;
          // Straight through sampled points of a triangle, so that there is something to find.
          for (const [x, y, z] of samples(near, 4)) {
            if (Math.abs(x - CENTRE[0]) > 5 || Math.abs(z - CENTRE[2]) > 5) continue;
            const found = solid.ground(x, z, top);
            const slow = floors
              .map((t) => heightAt(t, x, z))
              .filter((h): h is number => h !== undefined && h <= top - 1e-3);
            if (slow.length > 0) {
              expect(found).toBeDefined();
              expect(found ?? 0).toBeGreaterThan(Math.max(...slow) - 2e-3);
            }
            if (found !== undefined) expect(found).toBeLessThanOrEqual(top);
            if (steepness(near) > 0.61 && y < top - 1e-3) {
              expect(found ?? -Infinity).toBeGreaterThan(y - 0.02);
            }
          }
        },
      ),
      { numRuns: 200 },
    );
  });

  test('one push is enough to be clear of one wall, and nothing clear is moved', () => {
    fc.assert(
      fc.property(triangle, point, (wall, [x, , z]) => {
        fc.pre(steepness(wall) < 0.59);
        const radius = 0.5;
        const [low, high] = [CENTRE[1] - 0.5, CENTRE[1] + 1];
        const clearance = (px: number, pz: number): number => {
          let least = Infinity;
          for (const [sx, sy, sz] of samples(wall, 120)) {
            if (sy >= low && sy <= high) least = Math.min(least, Math.hypot(sx - px, sz - pz));
          }
          return least;
        };
        const before = clearance(x, z);
        const [px, pz] = solidOf([wall]).push(x, z, low, high, radius);
        if (before > radius + 0.25) expect([px, pz]).toEqual([x, z]);
        // A steep slope is as wide as its part between the heights; a few pushes leave it.
        if (steepness(wall) < 0.05) expect(clearance(px, pz)).toBeGreaterThan(radius - 0.02);
      }),
      { numRuns: 300 },
    );
  });

  test('foliage and what lies outside the heights let the walker through', () => {
    const [x, y, z] = CENTRE;
    const wall = square([x, y - 3, z - 5], [x, y - 3, z + 5], [x, y, z + 5], [x, y, z - 5]);
    const leaves = new Solid(buildSolid([batch(wall, 'mask')], CENTRE, SIZE));
    expect(leaves.triangles).toBe(0);
    expect(leaves.push(x + 0.1, z, y - 2, y - 1, 0.3)).toEqual([x + 0.1, z]);
    const solid = solidOf(wall);
    expect(solid.push(x + 0.1, z, y - 2, y - 1, 0.3)[0]).toBeCloseTo(x + 0.3, 5);
    expect(solid.push(x - 0.1, z, y - 2, y - 1, 0.3)[0]).toBeCloseTo(x - 0.3, 5);
    expect(solid.push(x + 0.1, z, y + 0.1, y + 2, 0.3)).toEqual([x + 0.1, z]);
  });

  test('a corner holds from both sides', () => {
    const [x, y, z] = CENTRE;
    const solid = solidOf([
      ...square([x, y - 3, z - 5], [x, y - 3, z + 5], [x, y + 3, z + 5], [x, y + 3, z - 5]),
      ...square([x - 5, y - 3, z], [x + 5, y - 3, z], [x + 5, y + 3, z], [x - 5, y + 3, z]),
    ]);
    const [px, pz] = solid.push(x + 0.1, z + 0.2, y - 1, y + 1, 0.4);
    expect(px).toBeCloseTo(x + 0.4, 5);
    expect(pz).toBeCloseTo(z + 0.4, 5);
  });

  test('under a roof the floor is the ground, above it the roof is', () => {
    const [x, y, z] = CENTRE;
    const at = (h: number): Triangle[] =>
      square([x - 9, h, z - 9], [x + 9, h, z - 9], [x + 9, h, z + 9], [x - 9, h, z + 9]);
    const solid = solidOf([...at(y - 2), ...at(y + 1)]);
    expect(solid.ground(x + 1, z + 1, y)).toBeCloseTo(y - 2, 5);
    expect(solid.ground(x + 1, z + 1, y + 1.5)).toBeCloseTo(y + 1, 5);
    expect(solid.ground(x + 1, z + 1, y - 2.5)).toBeUndefined();
  });
});

/** Height of a triangle over (x, z) by solving for its barycentric coordinates. */
function heightAt([a, b, c]: Triangle, x: number, z: number): number | undefined {
  const area = (b[0] - a[0]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[0] - a[0]);
  const s = ((x - a[0]) * (c[2] - a[2]) - (z - a[2]) * (c[0] - a[0])) / area;
  const t = ((b[0] - a[0]) * (z - a[2]) - (b[2] - a[2]) * (x - a[0])) / area;
  if (!(s >= 0 && t >= 0 && s + t <= 1)) return undefined;
  return a[1] + s * (b[1] - a[1]) + t * (c[1] - a[1]);
}
