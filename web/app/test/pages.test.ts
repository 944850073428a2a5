import { describe, expect, it } from 'vitest';
import fc from 'fast-check';
import { rootOf, sentenceOf } from '../src/api.js';
import { squaresOf } from '../src/bake/cells.js';
import { MapWindow } from '../src/map/view.js';
import {
  boxOf,
  corridorOf,
  floorNear,
  fromSuggestion,
  movedPoint,
  pointAt,
  withPoint,
  type Drawing,
} from '../src/scene/drawing.js';
import { bytes, duration, metres } from '../src/words.js';

const EMPTY: Drawing = { kind: 'path', points: [], width: 4, height: 3, eye: 1.7 };
const number = fc.double({ min: -1e4, max: 1e4, noNaN: true });

describe('the map', () => {
  it('goes from ground to pixels and back', () => {
    fc.assert(
      fc.property(
        number,
        number,
        fc.double({ min: 0.01, max: 100, noNaN: true }),
        (x, z, scale) => {
          const window = new MapWindow(800, 600, { x: 3, z: -5 }, scale);
          const back = window.spot(window.pixel({ x, z }));
          expect(back.x).toBeCloseTo(x, 5);
          expect(back.z).toBeCloseTo(z, 5);
        },
      ),
    );
  });

  it('shows all of an area, whatever its shape', () => {
    const window = MapWindow.fit(800, 600, { min: [-10, 0], max: [30, 400] });
    for (const [x, z] of [
      [-10, 0],
      [30, 400],
    ]) {
      const { left, top } = window.pixel({ x, z });
      expect(left).toBeGreaterThan(0);
      expect(left).toBeLessThan(800);
      expect(top).toBeGreaterThan(0);
      expect(top).toBeLessThan(600);
    }
  });

  it('keeps the spot under the pointer', () => {
    const window = new MapWindow(800, 600, { x: 3, z: -5 }, 2);
    const at = { left: 100, top: 500 };
    const spot = window.spot(at);
    const closer = window.zoomed(at, 3, 0.1, 100);
    expect(closer.scale).toBe(6);
    expect(closer.spot(at).x).toBeCloseTo(spot.x, 9);
    expect(window.zoomed(at, 1000, 0.1, 100).scale).toBe(100);
    const moved = window.moved(at, { left: 150, top: 480 });
    expect(moved.spot({ left: 150, top: 480 }).z).toBeCloseTo(spot.z, 9);
  });
});

describe('a drawing', () => {
  it('begins with what is suggested', () => {
    const corridor = {
      path: { points: [[0, 2, 0] as const], width: 8, height: 5 },
      follow_ground: true,
      eye_height: 1.6,
    };
    const drawing = fromSuggestion({ corridor, cell_size: 10, eye_height: 1.6 });
    expect(corridorOf(drawing)).toEqual(corridor);
  });

  it('is no corridor before there is enough of it', () => {
    expect(corridorOf(EMPTY)).toBeUndefined();
    const box: Drawing = { ...EMPTY, kind: 'box', points: [[0, 0, 0]] };
    expect(corridorOf(box)).toBeUndefined();
    expect(corridorOf(withPoint(box, { x: 0, z: 4 }, 0))).toBeUndefined();
    expect(corridorOf({ ...withPoint(EMPTY, { x: 1, z: 2 }, 0), width: 0 })).toBeUndefined();
  });

  it('makes boxes with positive extents from any two corners', () => {
    fc.assert(
      fc.property(number, number, number, number, (x0, z0, x1, z1) => {
        const drawing: Drawing = {
          ...EMPTY,
          kind: 'box',
          points: [
            [x0, 1, z0],
            [x1, 2, z1],
          ],
        };
        const corridor = corridorOf(drawing);
        if (x0 === x1 || z0 === z1) expect(corridor).toBeUndefined();
        else {
          const { min, max } = corridor?.box ?? { min: [0, 0, 0], max: [0, 0, 0] };
          expect([0, 1, 2].every((axis) => max[axis] > min[axis])).toBe(true);
          expect(boxOf(drawing)?.min[0]).toBe(min[0]);
        }
      }),
    );
  });

  it('finds, moves and lays points', () => {
    const drawing = withPoint(withPoint(EMPTY, { x: 0, z: 0 }, 5), { x: 10, z: 0 }, 7);
    expect(pointAt(drawing, { x: 9, z: 0 }, 2)).toBe(1);
    expect(pointAt(drawing, { x: 5, z: 0 }, 2)).toBe(-1);
    expect(movedPoint(drawing, 1, { x: 1, z: 2 }).points).toEqual([
      [0, 5, 0],
      [1, 7, 2],
    ]);
    expect(floorNear(drawing.points, { x: 8, z: 3 }, 0)).toBe(7);
    expect(floorNear([], { x: 8, z: 3 }, 3)).toBe(3);
  });
});

describe('the cells of a bake', () => {
  it('lie where the grid says, inline and in pages', async () => {
    const table = { i: [0, 1], j: [0, 0], k: [0, 2] };
    const grid = { origin: [5, 0, -5] as const, size: [10, 4, 20] as const };
    const inline = await squaresOf({ ...grid, cells: table }, () => Promise.reject(new Error()));
    expect(inline.all).toEqual([
      { name: '0_0_0', x: 5, z: -5 },
      { name: '1_0_2', x: 15, z: 35 },
    ]);
    expect(inline.area).toEqual({ min: [5, -5], max: [25, 55] });
    const paged = await squaresOf({ ...grid, pages: [{ href: 'pages/0.json' }] }, (href) => {
      expect(href).toBe('pages/0.json');
      return Promise.resolve(table);
    });
    expect(paged).toEqual(inline);
  });
});

describe('addresses and words', () => {
  it.each([
    ['https://h/', 'https://h/'],
    ['https://h/scene/abc', 'https://h/'],
    ['https://h/far/bake/abc/', 'https://h/far/'],
    ['https://h/far/index.html', 'https://h/far/'],
  ])('finds the root of %s', (page, root) => {
    expect(rootOf(new URL(page)).href).toBe(root);
  });

  it('tells what the server said', () => {
    expect(sentenceOf(422, '{"detail": "It is too large."}')).toBe('It is too large.');
    expect(sentenceOf(502, '<html>')).toContain('502');
    expect(sentenceOf(500, '{"detail": 5}')).toContain('500');
  });

  it('says numbers as people do', () => {
    expect([bytes(12), bytes(1500), bytes(153e6), bytes(2e10)]).toEqual([
      '12 B',
      '1.5 KB',
      '153 MB',
      '20 GB',
    ]);
    expect([duration(0), duration(89), duration(300), duration(9000), duration(1e6)]).toEqual([
      '1 s',
      '89 s',
      '5 min',
      '2.5 h',
      '12 days',
    ]);
    expect([metres(0.25), metres(42.2), metres(250), metres(1738)]).toEqual([
      '0.25 m',
      '42 m',
      '250 m',
      '1.74 km',
    ]);
  });
});
