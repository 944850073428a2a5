/** Shared generators. */

import fc from 'fast-check';
import type { CellPage, CellTable, Vec3, WalkGrid } from '../src/index.js';

export const near = (a: number, b: number, tolerance: number): boolean =>
  Math.abs(a - b) <= tolerance * Math.max(1, Math.abs(a), Math.abs(b));

export const vec3 = (most: number): fc.Arbitrary<Vec3> =>
  fc.tuple(
    ...([0, 1, 2] as const).map(() => fc.double({ min: -most, max: most, noNaN: true })),
  ) as unknown as fc.Arbitrary<Vec3>;

/** A grid of cells, some of them missing, columns at different heights. */
export const grid: fc.Arbitrary<WalkGrid & { cells: CellTable }> = fc
  .record({
    origin: vec3(50),
    size: fc.tuple(
      fc.double({ min: 1, max: 9, noNaN: true }),
      fc.double({ min: 1, max: 5, noNaN: true }),
      fc.double({ min: 1, max: 9, noNaN: true }),
    ),
    places: fc.uniqueArray(
      fc.record({
        i: fc.integer({ min: -4, max: 4 }),
        j: fc.integer({ min: 0, max: 1 }),
        k: fc.integer({ min: -4, max: 4 }),
        lift: fc.double({ min: 0, max: 0.9, noNaN: true }),
      }),
      { minLength: 1, maxLength: 40, selector: ({ i, j, k }) => `${i},${j},${k}` },
    ),
  })
  .map(({ origin, size, places }) => ({
    origin,
    size,
    total: places.length,
    cells: {
      i: places.map(({ i }) => i),
      j: places.map(({ j }) => j),
      k: places.map(({ k }) => k),
      // One lift a column, so that cells of a column touch but do not overlap.
      y: places.map(
        ({ i, j, k }) =>
          origin[1] + (j + (places.find((p) => p.i === i && p.k === k)?.lift ?? 0)) * size[1],
      ),
    },
  }));

/** The same grid with its cells in pages. */
export function paged(
  whole: WalkGrid & { cells: CellTable },
  perPage: number,
): { grid: WalkGrid; tables: Map<string, CellTable> } {
  const tables = new Map<string, CellTable>();
  const pages: CellPage[] = [];
  const { i, j, k, y } = whole.cells;
  const { origin, size } = whole;
  for (let first = 0; first < i.length; first += perPage) {
    const part = <T>(column: readonly T[]): T[] => column.slice(first, first + perPage);
    const table = { i: part(i), j: part(j), k: part(k), y: part(y) };
    const href = `pages/${pages.length}.json`;
    tables.set(href, table);
    const lows = table.i.map((_, n): Vec3 => [
      origin[0] + table.i[n] * size[0],
      table.y[n],
      origin[2] + table.k[n] * size[2],
    ]);
    const bound = (pick: (values: number[]) => number, extent: number): Vec3 => {
      const side = (axis: 0 | 1 | 2): number =>
        pick(lows.map((low) => low[axis])) + extent * size[axis];
      return [side(0), side(1), side(2)];
    };
    pages.push({
      href,
      cells: table.i.length,
      bounds: { min: bound((v) => Math.min(...v), 0), max: bound((v) => Math.max(...v), 1) },
    });
  }
  return { grid: { origin, size, total: i.length, pages }, tables };
}
