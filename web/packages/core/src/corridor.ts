/** Soft walls: the eye stays within the union of cells and slides along its edge. */

import type { Cell } from './cells.js';
import type { CellIndex } from './cell-index.js';
import type { Vec3 } from './format.js';

/** Distance kept from the edge of the corridor, as a share of the cell's edge. */
const MARGIN = 0.02;

export interface Slide {
  readonly eye: Vec3;
  /** Whether a wall changed the step across the ground. */
  readonly blocked: boolean;
}

/**
 * Move from `from`, inside the corridor, towards `to`: as far as cells go, sliding along walls,
 * the height clamped into the cells at the new place. Steps longer than half a cell are divided,
 * so a fast walker does not jump over a gap.
 */
export function slide(index: CellIndex, from: Vec3, to: Vec3): Slide {
  const { size } = index.grid;
  const longest = Math.max(...[0, 2].map((axis) => Math.abs(to[axis] - from[axis]) / size[axis]));
  const parts = Math.min(64, Math.max(1, Math.ceil(2 * longest)));
  let eye = from;
  let blocked = false;
  for (let n = 0; n < parts; n++) {
    const step: Vec3 = [
      (to[0] - from[0]) / parts,
      (to[1] - from[1]) / parts,
      (to[2] - from[2]) / parts,
    ];
    const next: Vec3 = [eye[0] + step[0], eye[1] + step[1], eye[2] + step[2]];
    const moved = [next, [next[0], next[1], eye[2]], [eye[0], next[1], next[2]]] as const;
    const place = moved.map((at) => stand(index, at, eye)).find((at) => at !== undefined);
    const free = stand(index, next, eye) !== undefined;
    if (!free) blocked = true;
    eye = place ?? stand(index, [eye[0], next[1], eye[2]], eye) ?? eye;
  }
  return { eye, blocked };
}

/** The nearest place inside the corridor, anywhere. */
export function clampInto(index: CellIndex, point: Vec3): Vec3 {
  const cell = index.nearest(point);
  return cell === undefined ? point : inside(cell, point, index.grid.size);
}

/**
 * The place at `at` with its height clamped into the column of cells there, or undefined if there
 * is no column, if a wall is too near, or if the floor there is out of reach from `from`.
 */
function stand(index: CellIndex, at: Vec3, from: Vec3): Vec3 | undefined {
  const { size } = index.grid;
  const column = columnAt(index, at);
  const cell = nearestInHeight(column, at[1]);
  if (cell === undefined) return undefined;
  const step = Math.max(cell.low[1] - from[1], from[1] - cell.high[1], 0);
  if (step > size[1]) return undefined;
  for (const axis of [0, 2] as const) {
    const margin = MARGIN * size[axis];
    for (const side of [-margin, margin]) {
      const beside: [number, number, number] = [...at];
      beside[axis] += side;
      const outside = at[axis] + side < cell.low[axis] || at[axis] + side >= cell.high[axis];
      // Leaving the margin is always allowed, or a walker who starts in it could not move.
      const leaving = Math.sign(at[axis] - from[axis]) === -Math.sign(side);
      if (outside && !leaving && columnAt(index, beside).length === 0) return undefined;
    }
  }
  return [at[0], clampHeight(column, cell, at[1], size[1]), at[2]];
}

function columnAt(index: CellIndex, at: Vec3): Cell[] {
  const { origin, size } = index.grid;
  const i = Math.floor((at[0] - origin[0]) / size[0]);
  const k = Math.floor((at[2] - origin[2]) / size[2]);
  return index.column(i, k);
}

function nearestInHeight(column: readonly Cell[], y: number): Cell | undefined {
  const distance = (cell: Cell): number => Math.max(cell.low[1] - y, y - cell.high[1], 0);
  return column.length === 0
    ? undefined
    : column.reduce((best, cell) => (distance(cell) < distance(best) ? cell : best));
}

function clampHeight(column: readonly Cell[], cell: Cell, y: number, height: number): number {
  const margin = MARGIN * height;
  const touches = (level: number): boolean =>
    column.some((other) => other !== cell && other.low[1] <= level && other.high[1] >= level);
  const low = touches(cell.low[1]) ? cell.low[1] : cell.low[1] + margin;
  const high = touches(cell.high[1]) ? cell.high[1] : cell.high[1] - margin;
  return Math.min(Math.max(y, low), high);
}

function inside(cell: Cell, point: Vec3, size: Vec3): Vec3 {
  const clamp = (axis: 0 | 1 | 2): number =>
    Math.min(
      Math.max(point[axis], cell.low[axis] + MARGIN * size[axis]),
      cell.high[axis] - MARGIN * size[axis],
    );
  return [clamp(0), clamp(1), clamp(2)];
}
