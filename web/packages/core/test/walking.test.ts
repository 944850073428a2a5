/** Which cell is wanted, in which order others are, and where a walker may go. */

import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  CellIndex,
  HYSTERESIS,
  cellContains,
  cellDistance,
  clampInto,
  prefetchOrder,
  shownCell,
  slide,
  wantedCell,
  type Cell,
  type Vec3,
} from '../src/index.js';
import { grid, vec3 } from './random.js';

const row = (count: number): CellIndex =>
  new CellIndex({
    origin: [0, 0, 0],
    size: [10, 4, 10],
    total: count,
    cells: {
      i: Array.from({ length: count }, (_, n) => n),
      j: Array<number>(count).fill(0),
      k: Array<number>(count).fill(0),
      y: Array<number>(count).fill(0),
    },
  });

const at = (index: CellIndex, x: number): Cell => {
  const cell = index.at([x, 2, 5]);
  if (cell === undefined) throw new Error(`no cell at ${x}`);
  return cell;
};

describe('prefetchOrder', () => {
  const index = row(9);
  const order = (vx: number, lookX: number): string[] =>
    prefetchOrder(
      index.loaded(),
      { eye: [45, 2, 5], velocity: [vx, 0, 0], view: [lookX, 0, 0] },
      index.grid.size,
    ).map(({ name }) => name);

  test('the walker’s own cell comes first, then what lies ahead', () => {
    expect(order(5, 1).slice(0, 3)).toEqual(['4_0_0', '5_0_0', '6_0_0']);
    expect(order(-5, -1).slice(0, 3)).toEqual(['4_0_0', '3_0_0', '2_0_0']);
  });

  test('standing still, the view decides between neighbours', () => {
    expect(order(0, 1)[1]).toBe('5_0_0');
    expect(order(0, -1)[1]).toBe('3_0_0');
  });

  test('motion outweighs the view', () => {
    expect(order(8, -1)[1]).toBe('5_0_0');
  });

  test('orders all cells, and farther ones ahead come later', () => {
    fc.assert(
      fc.property(grid, vec3(60), vec3(3), (whole, eye, velocity) => {
        const all = [...new CellIndex(whole).loaded()];
        const ordered = prefetchOrder(all, { eye, velocity, view: [0, 0, -1] }, whole.size);
        expect(new Set(ordered)).toEqual(new Set(all));
        const inside = all.find((cell) => cellContains(cell, eye));
        if (inside !== undefined) expect(cellDistance(ordered[0], eye)).toBe(0);
      }),
    );
    const ahead = order(5, 1).filter((name) => Number(name[0]) > 4);
    expect(ahead).toEqual(['5_0_0', '6_0_0', '7_0_0', '8_0_0']);
  });
});

describe('wantedCell', () => {
  const index = row(3);

  test('keeps the cell until its border is clearly passed', () => {
    const first = at(index, 5);
    const margin = HYSTERESIS * index.cellSize;
    expect(wantedCell(index, [10 + 0.9 * margin, 2, 5], first)?.name).toBe('0_0_0');
    expect(wantedCell(index, [10 + 1.1 * margin, 2, 5], first)?.name).toBe('1_0_0');
    expect(wantedCell(index, [10.001, 2, 5])?.name).toBe('1_0_0');
  });

  test('someone who trembles on a border sees one change at most', () => {
    let current = wantedCell(index, [9.9, 2, 5]);
    let changes = 0;
    for (let n = 0; n < 100; n++) {
      const next = wantedCell(index, [10 + 0.05 * Math.sin(n), 2, 5], current);
      if (next !== current) changes++;
      current = next;
    }
    expect(changes).toBeLessThanOrEqual(1);
  });

  test('outside, the nearest cell is wanted', () => {
    expect(wantedCell(index, [-50, 30, 5])?.name).toBe('0_0_0');
  });
});

describe('shownCell', () => {
  const index = row(5);
  const cells = [...index.loaded()];

  test('the wanted cell if it is complete', () => {
    expect(shownCell([25, 2, 5], cells[2], cells[1], [cells[1], cells[2]])).toBe(cells[2]);
  });

  test('else what is shown, unless a complete one is nearer', () => {
    expect(shownCell([21, 2, 5], cells[2], cells[1], [cells[1], cells[3]])).toBe(cells[1]);
    expect(shownCell([28, 2, 5], cells[2], cells[1], [cells[1], cells[3]])).toBe(cells[3]);
  });

  test('at first the nearest complete cell, and nothing without one', () => {
    expect(shownCell([5, 2, 5], cells[0], undefined, [cells[4], cells[1]])).toBe(cells[1]);
    expect(shownCell([5, 2, 5], cells[0], undefined, [])).toBeUndefined();
  });
});

describe('slide', () => {
  const within = (index: CellIndex, eye: Vec3): boolean =>
    [...index.loaded()].some((cell) => cellContains(cell, eye, 1e-9));

  test('never leaves the corridor, whatever the steps', () => {
    fc.assert(
      fc.property(grid, vec3(40), fc.array(vec3(12), { maxLength: 12 }), (whole, start, steps) => {
        const index = new CellIndex(whole);
        let eye = clampInto(index, start);
        expect(within(index, eye)).toBe(true);
        for (const step of steps) {
          eye = slide(index, eye, [eye[0] + step[0], eye[1] + step[1], eye[2] + step[2]]).eye;
          expect(within(index, eye)).toBe(true);
        }
      }),
    );
  });

  test('goes along a wall and says so', () => {
    const { eye, blocked } = slide(row(3), [5, 2, 9], [9, 2, 14]);
    expect(blocked).toBe(true);
    expect(eye[0]).toBe(9);
    expect(eye[2]).toBeLessThanOrEqual(10);
  });

  test('crosses a border between cells freely', () => {
    const { eye, blocked } = slide(row(3), [5, 2, 5], [15, 2, 5]);
    expect(eye).toEqual([15, 2, 5]);
    expect(blocked).toBe(false);
  });

  test('does not jump over a gap, however fast', () => {
    const index = new CellIndex({
      origin: [0, 0, 0],
      size: [10, 4, 10],
      total: 2,
      cells: { i: [0, 2], j: [0, 0], k: [0, 0], y: [0, 0] },
    });
    expect(slide(index, [5, 2, 5], [25, 2, 5]).eye[0]).toBeLessThan(10);
  });

  test('follows cells that climb, but not up a cliff', () => {
    const climbing = (step: number): CellIndex =>
      new CellIndex({
        origin: [0, 0, 0],
        size: [10, 4, 10],
        total: 2,
        cells: { i: [0, 1], j: [0, 0], k: [0, 0], y: [0, step] },
      });
    const up = slide(climbing(3), [9, 1.6, 5], [11, 1.6, 5]).eye;
    expect(up[0]).toBe(11);
    expect(up[1]).toBeGreaterThan(3);
    expect(slide(climbing(30), [9, 1.6, 5], [11, 1.6, 5]).blocked).toBe(true);
  });

  test('height is kept inside the cells', () => {
    const { eye } = slide(row(1), [5, 2, 5], [5, 9, 5]);
    expect(eye[1]).toBeLessThan(4);
    expect(eye[1]).toBeGreaterThan(3.8);
  });
});
