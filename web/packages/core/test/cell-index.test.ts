import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { CellIndex, cellDistance, type CellTable, type Vec3, type WalkGrid } from '../src/index.js';
import { grid, paged, vec3 } from './random.js';

const EMPTY: CellTable = { i: [], j: [], k: [], y: [] };

const names = (cells: Iterable<{ name: string }>): string[] => [...cells].map((c) => c.name).sort();

describe('CellIndex', () => {
  test('finds the cell at a point, like a search through all', () => {
    fc.assert(
      fc.property(grid, vec3(80), (whole, point) => {
        const index = new CellIndex(whole);
        // Rounding may put a point that lies on a border on either side of it.
        const onBorder = [...index.loaded()].some(({ low, high }) =>
          [0, 1, 2].some((axis) =>
            [low, high].some((corner) => Math.abs(corner[axis] - point[axis]) < 1e-9),
          ),
        );
        fc.pre(!onBorder);
        const inside = [...index.loaded()].filter(
          ({ low, high }) =>
            point[0] >= low[0] &&
            point[0] < high[0] &&
            point[1] >= low[1] &&
            point[1] < high[1] &&
            point[2] >= low[2] &&
            point[2] < high[2],
        );
        expect(inside.length).toBeLessThanOrEqual(1);
        expect(index.at(point)?.name).toBe(inside.at(0)?.name);
      }),
    );
  });

  test('finds the cells near a point and the nearest one', () => {
    fc.assert(
      fc.property(
        grid,
        vec3(80),
        fc.double({ min: 0, max: 40, noNaN: true }),
        (whole, point, radius) => {
          const index = new CellIndex(whole);
          const all = [...index.loaded()];
          const wanted = all.filter((cell) => cellDistance(cell, point) <= radius);
          expect(names(index.near(point, radius))).toEqual(names(wanted));
          const nearest = index.nearest(point);
          const least = Math.min(...all.map((cell) => cellDistance(cell, point)));
          expect(nearest && cellDistance(nearest, point)).toBeCloseTo(least, 9);
        },
      ),
    );
  });

  test('every cell contains its centre, and boxes are of the grid’s size', () => {
    fc.assert(
      fc.property(grid, (whole) => {
        const index = new CellIndex(whole);
        for (const cell of index.loaded()) {
          expect(index.at(cell.centre)?.name).toBe(cell.name);
          for (const axis of [0, 1, 2]) {
            expect(cell.high[axis] - cell.low[axis]).toBeCloseTo(whole.size[axis], 9);
          }
        }
      }),
    );
  });

  test('pages give the same answers once they are loaded', async () => {
    await fc.assert(
      fc.asyncProperty(
        grid,
        vec3(60),
        fc.integer({ min: 1, max: 7 }),
        async (whole, point, per) => {
          const inline = new CellIndex(whole);
          const { grid: withPages, tables } = paged(whole, per);
          const index = new CellIndex(withPages, (href) =>
            Promise.resolve(tables.get(href) ?? EMPTY),
          );
          expect(index.at(point)).toBeUndefined();
          await index.ensure(point, 20);
          expect(index.at(point)?.name).toBe(inline.at(point)?.name);
          expect(names(index.near(point, 20))).toEqual(names(inline.near(point, 20)));
          await index.ensureNearest(point);
          const [a, b] = [index.nearest(point), inline.nearest(point)];
          expect(a && cellDistance(a, point)).toBeCloseTo(b ? cellDistance(b, point) : NaN, 9);
        },
      ),
      { numRuns: 50 },
    );
  });

  test('a point on the rounded side of a page finds its cell', async () => {
    // 6.5 lies in cell 3 by its index, but 0.2 + 3 * 2.1, where that cell begins, rounds above it.
    const whole: WalkGrid & { cells: CellTable } = {
      origin: [0.2, 0, 0],
      size: [2.1, 1, 1],
      total: 4,
      cells: { i: [0, 1, 2, 3], j: [0, 0, 0, 0], k: [0, 0, 0, 0], y: [0, 0, 0, 0] },
    };
    const { grid: withPages, tables } = paged(whole, 3);
    const index = new CellIndex(withPages, (href) => Promise.resolve(tables.get(href) ?? EMPTY));
    const point: Vec3 = [6.5, 0.5, 0.5];
    await index.ensure(point, 0);
    expect(index.at(point)?.name).toBe('3_0_0');
  });

  test('of a million cells only the pages around the walker are held', async () => {
    const perSide = 100;
    const side = 10;
    const pages = Array.from({ length: perSide * perSide }, (_, n) => {
      const [x, z] = [(n % perSide) * side * 10, Math.floor(n / perSide) * side * 10];
      return {
        href: String(n),
        cells: side * side,
        bounds: { min: [x, 0, z], max: [x + side * 10, 10, z + side * 10] } as const,
      };
    });
    const million: WalkGrid = {
      origin: [0, 0, 0],
      size: [10, 10, 10],
      total: 1_000_000,
      pages,
    };
    let loads = 0;
    const index = new CellIndex(
      million,
      (href) => {
        loads++;
        const n = Number(href);
        const [i0, k0] = [(n % perSide) * side, Math.floor(n / perSide) * side];
        const places = Array.from({ length: side * side }, (_, m) => [
          i0 + (m % side),
          k0 + Math.floor(m / side),
        ]);
        return Promise.resolve({
          i: places.map(([i]) => i),
          j: places.map(() => 0),
          k: places.map(([, k]) => k),
          y: places.map(() => 0),
        });
      },
      16,
    );
    for (let step = 0; step < 200; step++) {
      const eye = [5000 + 20 * step, 5, 5005] as const;
      await index.ensure(eye, 40);
      expect(index.at(eye)?.index).toEqual([500 + 2 * step, 0, 500]);
      expect(index.loadedPages).toBeLessThanOrEqual(16);
    }
    expect(loads).toBeLessThan(200);
  });

  test('two callers share one request for a page, and a failed one is asked for again', async () => {
    const { grid: withPages, tables } = paged(
      { origin: [0, 0, 0], size: [1, 1, 1], total: 1, cells: { i: [0], j: [0], k: [0], y: [0] } },
      1,
    );
    let asked = 0;
    const index = new CellIndex(withPages, (href) =>
      ++asked === 1
        ? Promise.reject(new Error('offline'))
        : Promise.resolve(tables.get(href) ?? EMPTY),
    );
    const point = [0.5, 0.5, 0.5] as const;
    await expect(index.ensure(point, 1)).rejects.toThrow('offline');
    await Promise.all([index.ensure(point, 1), index.ensure(point, 1)]);
    expect(asked).toBe(2);
    expect(index.at(point)?.name).toBe('0_0_0');
  });
});
