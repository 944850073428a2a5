import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  FACES,
  FarfieldError,
  PAGES,
  QUADS,
  buildQuadVertices,
  type CellFile,
  type Vec3,
} from '../src/index.js';
import { near, vec3 } from './random.js';

const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function cellWith(quads: Partial<CellFile['quads']>, eyes: readonly Vec3[]): CellFile {
  return {
    format: 'farfield-cell',
    version: 1,
    cell: [0, 0, 0],
    eyes,
    atlases: ['a.png', 'b.png'],
    near: [],
    figures: {},
    quads: {
      eyes: [0],
      faces: [0],
      layers: [-1],
      corner_counts: [3],
      corners: [0, 0, 8, 0, 8, 8],
      planes: [0, 0, 0.1],
      pages: [0],
      scales: [1],
      offsets: [0, 0],
      turned: [0],
      ...quads,
    },
  };
}

describe('faces', () => {
  test.each([0, 1, 2, 3, 4, 5])('face %i has right-handed unit axes', (n) => {
    const { right, down, forward } = FACES[n];
    expect([dot(right, down), dot(down, forward), dot(right, forward)]).toEqual([0, 0, 0]);
    expect([dot(right, right), dot(down, down), dot(forward, forward)]).toEqual([1, 1, 1]);
    // forward = right x down
    expect(forward[0]).toBeCloseTo(right[1] * down[2] - right[2] * down[1]);
    expect(forward[1]).toBeCloseTo(right[2] * down[0] - right[0] * down[2]);
    expect(forward[2]).toBeCloseTo(right[0] * down[1] - right[1] * down[0]);
  });
});

describe('buildQuadVertices', () => {
  test('a vertex is the point that projects to its corner', () => {
    fc.assert(
      fc.property(
        fc.integer({ min: 0, max: 5 }),
        fc.array(vec3(1000), { minLength: 2, maxLength: 2 }),
        fc.tuple(
          fc.double({ min: -0.01, max: 0.01, noNaN: true }),
          fc.double({ min: -0.01, max: 0.01, noNaN: true }),
          fc.double({ min: 0.021, max: 0.5, noNaN: true }),
        ),
        (face, eyes, plane) => {
          const corners = [0, 3, 64, 0, 50, 64];
          const { positions } = buildQuadVertices(
            cellWith({ faces: [face], eyes: [1], corners, planes: plane }, eyes),
            64,
          );
          const { right, down, forward } = FACES[face];
          for (let n = 0; n < 3; n++) {
            const w = positions[4 * n + 3];
            const at = (axis: 0 | 1 | 2): number =>
              positions[4 * n + axis] / w + eyes[0][axis] - eyes[1][axis];
            const q: Vec3 = [at(0), at(1), at(2)];
            const z = dot(q, forward);
            const u = (2 * corners[2 * n]) / 64 - 1;
            const v = (2 * corners[2 * n + 1]) / 64 - 1;
            // Single precision of a point up to 3,500 m off the centre, seen from 2 m at least.
            expect(near(dot(q, right) / z, u, 2e-3)).toBe(true);
            expect(near(dot(q, down) / z, v, 2e-3)).toBe(true);
            expect(near(w, plane[0] * u + plane[1] * v + plane[2], 1e-6)).toBe(true);
          }
        },
      ),
    );
  });

  test('texel coordinates are scaled, turned and moved', () => {
    const eyes: Vec3[] = [[0, 0, 0]];
    const plain = buildQuadVertices(
      cellWith({ scales: [0.5], offsets: [10, 20], pages: [1] }, eyes),
      64,
    );
    expect([...plain.texels]).toEqual([10, 20, 1, 14, 20, 1, 14, 24, 1]);
    const turned = buildQuadVertices(cellWith({ turned: [1], offsets: [10, 20] }, eyes), 64);
    expect([...turned.texels]).toEqual([10, 20, 0, 10, 28, 0, 18, 28, 0]);
  });

  test('corners that go round the other way face the same eye', () => {
    const quad = { corner_counts: [4], corners: [0, 8, 8, 8, 8, 0, 0, 0] };
    const { indices } = buildQuadVertices(cellWith(quad, [[0, 0, 0]]), 64);
    expect([...indices]).toEqual([0, 1, 2, 0, 2, 3]);
  });

  test('polygons become fans in the order of the file', () => {
    const { indices, quads, texels } = buildQuadVertices(
      cellWith(
        {
          eyes: [0, 0],
          faces: [0, 1],
          layers: [0, 0],
          corner_counts: [4, 3],
          corners: [0, 0, 8, 0, 8, 8, 0, 8, 1, 1, 2, 1, 2, 2],
          planes: [0, 0, 0.1, 0, 0, 0.05],
          pages: [0, 1],
          scales: [1, 1],
          offsets: [0, 0, 0, 0],
          turned: [0, 0],
        },
        [[0, 0, 0]],
      ),
      64,
    );
    expect(quads).toBe(2);
    // counter-clockwise on a screen whose rows go down
    expect([...indices]).toEqual([0, 2, 1, 0, 3, 2, 4, 6, 5]);
    // The third coordinate tells the page and the quad.
    const codes = [...texels].filter((_, n) => n % 3 === 2);
    expect(codes.map((code) => code % PAGES)).toEqual([0, 0, 0, 0, 1, 1, 1]);
    expect(codes.map((code) => Math.floor(code / PAGES))).toEqual([0, 0, 0, 0, 1, 1, 1]);
    expect(Math.fround(PAGES * QUADS - 1)).toBe(PAGES * QUADS - 1);
  });

  test('a corner at infinity has w 0, also where rounding makes it negative', () => {
    const { positions } = buildQuadVertices(cellWith({ planes: [0, 0, -1e-18] }, [[5, 6, 7]]), 64);
    expect([positions[3], positions[7], positions[11]]).toEqual([0, 0, 0]);
    expect(positions[0]).toBe(1);
  });

  test.each([
    [{ corner_counts: [2] }, '3 to 8'],
    [{ corner_counts: [9] }, '3 to 8'],
    [{ planes: [0, 0] }, 'planes'],
    [{ corners: [0, 0] }, 'corners'],
    [{ eyes: [1] }, 'eye'],
    [{ faces: [6] }, 'face'],
    [{ pages: [2] }, 'page'],
    [{ pages: [-1] }, 'page'],
  ])('%o is refused', (change, says) => {
    expect(() => buildQuadVertices(cellWith(change, [[0, 0, 0]]), 64)).toThrow(FarfieldError);
    expect(() => buildQuadVertices(cellWith(change, [[0, 0, 0]]), 64)).toThrow(says);
  });
});
