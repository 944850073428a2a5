import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  NearBuild,
  placePoint,
  sortByCopy,
  switchDistance,
  switchFocal,
  vectors,
  type Copy,
  type ObjectFile,
  type Vec3,
} from '../../src/index.js';
import { makeGlb } from '../glb-maker.js';

const FILE: ObjectFile = {
  format: 'farfield-object',
  version: 1,
  name: 'tree',
  low: [-1, 0, -2],
  high: [1, 5, 2],
  axes: [0, 1, 2],
  resolution: 100,
  textures: 2,
  image: 'tree.png',
  triangles: 1000,
  error: 0.08,
};
const CELL = { centre: [10, 2, 3] as Vec3, size: [6, 4, 6] as Vec3, nearField: 60 };

const number = (min: number, max: number) => fc.double({ min, max, noNaN: true });
const turn = fc
  .tuple(number(-1, 1), number(-1, 1), number(-1, 1), number(0.1, 1))
  .map((q): Copy['turn'] => {
    const [a, b, c, w] = q.map((x) => x / Math.hypot(...q));
    return [a, b, c, w];
  });
const copy = fc.record({
  shape: fc.constant('tree'),
  place: fc.tuple(number(-80, 80), number(-40, 40), number(-80, 80), number(0.2, 3)),
  turn,
});

describe('switchFocal', () => {
  test('nowhere in the cell is an error of more than a pixel', () => {
    fc.assert(
      fc.property(copy, fc.tuple(number(0, 1), number(0, 1), number(0, 1)), (one, share) => {
        const focal = switchFocal(one, FILE, CELL);
        if (focal === 0) return;
        const eye = share.map((s, n) => CELL.centre[n] + (s - 0.5) * CELL.size[n]);
        const inside: Vec3 = [0.3, 2, -1]; // any point of the object
        const away = vectors.distance(placePoint(one, inside), [eye[0], eye[1], eye[2]]);
        expect(away).toBeGreaterThanOrEqual(switchDistance(FILE, focal, one.place[3]) * (1 - 1e-9));
      }),
    );
  });

  test('what reaches out of the near field, or into the cell, never is one', () => {
    const at = (x: number): number =>
      switchFocal({ shape: 'tree', place: [x, 2, 3, 1], turn: [0, 0, 0, 1] }, FILE, CELL);
    expect(at(10)).toBe(0);
    expect(at(69.5)).toBe(0);
    expect(at(68)).toBeCloseTo((68 - 1 - 13) / 0.08);
    // Twice as large, it is off by twice as much.
    const large: Copy = { shape: 'tree', place: [40, 2, 3, 2], turn: [0, 0, 0, 1] };
    expect(switchFocal(large, FILE, CELL)).toBeCloseTo((40 - 2 - 13) / 0.16);
  });
});

describe('sortByCopy', () => {
  test('the first k copies and what belongs to none are a prefix, in the order they had', () => {
    const owners = fc.array(fc.integer({ min: -1, max: 4 }), { maxLength: 40 });
    const order = fc.shuffledSubarray([0, 1, 2, 3, 4], { minLength: 5 });
    fc.assert(
      fc.property(owners, order, (list, sorted) => {
        const indices = Uint32Array.from({ length: 3 * list.length }, (_, n) => n);
        const ends = sortByCopy({ indices, owners: Int32Array.from(list) }, sorted);
        for (let k = 0; k <= 5; k++) {
          const wanted = [-1, ...sorted.slice(0, k)].flatMap((copy) =>
            list.flatMap((owner, n) => (owner === copy ? [3 * n, 3 * n + 1, 3 * n + 2] : [])),
          );
          expect([...indices.subarray(0, ends[k])]).toEqual(wanted);
        }
      }),
    );
  });
});

/** A block of two triangles, of which the second is part of a copy. */
function block(x: number, extras: object, owners = [0, 1]): ArrayBuffer {
  const positions = new Float32Array([
    x,
    0,
    0,
    x + 1,
    0,
    0,
    x,
    1,
    0,
    x,
    0,
    9,
    x + 1,
    0,
    9,
    x,
    1,
    9,
  ]);
  return makeGlb(
    {
      nodes: [{ mesh: 0 }],
      meshes: [
        { primitives: [{ attributes: { POSITION: 0 }, indices: 1, extras: { owners: 2 } }] },
      ],
      extras,
    },
    [
      { data: positions, componentType: 5126, type: 'VEC3', count: 6 },
      { data: new Uint16Array([0, 1, 2, 3, 4, 5]), componentType: 5123, type: 'SCALAR', count: 6 },
      { data: new Uint16Array(owners), componentType: 5123, type: 'SCALAR', count: owners.length },
    ],
  );
}

const OBJECTS = { shapes: ['tree'], shape: [0], places: [1, 2, 3, 1], turns: [0, 0, 0, 1] };

describe('copies in near blocks', () => {
  test('a copy with triangles in two blocks is one', () => {
    const other = { ...OBJECTS, shape: [0, 0], places: [9, 9, 9, 1, ...OBJECTS.places] };
    const near = new NearBuild([0, 0, 0]);
    near.add({ bytes: block(0, { objects: OBJECTS }), ranges: [0, 0, 2] });
    near.add({
      bytes: block(5, { objects: { ...other, turns: [0, 0, 0, 1, 0, 0, 0, 1] } }, [1, 2]),
      ranges: [0, 1, 1],
    });
    near.add({ bytes: block(7, {}, [0, 0]), ranges: [0, 0, 2] });
    const batches = near.finish();
    expect(near.copies.map(({ place }) => place)).toEqual([
      [1, 2, 3, 1],
      [9, 9, 9, 1],
    ]);
    expect(batches).toHaveLength(1);
    const [{ indices, owners, positions }] = batches;
    // Owners stay with their triangles however these are sorted.
    const found = [...owners].map((owner, n) => [positions[3 * indices[3 * n]], owner]);
    expect(found.sort((a, b) => a[0] - b[0] || a[1] - b[1])).toEqual([
      [0, -1],
      [0, 0],
      [5, 0],
      [7, -1],
      [7, -1],
    ]);
  });

  test('columns that contradict each other are refused', () => {
    const bad = [
      block(0, { objects: { ...OBJECTS, places: [1, 2, 3] } }),
      block(0, { objects: { ...OBJECTS, shape: [1] } }),
      block(0, { objects: OBJECTS }, [0, 2]),
      block(0, { objects: OBJECTS }, [0]),
    ];
    for (const bytes of bad) {
      const near = new NearBuild([0, 0, 0]);
      expect(() => near.add({ bytes, ranges: [0, 0, 2] })).toThrow(/near block/);
    }
  });
});
