/** One view cell and the geometry of its box. */

import type { Vec3 } from './format.js';

export interface Cell {
  /** `i_j_k`, as in the name of its file. */
  readonly name: string;
  readonly index: Vec3;
  readonly low: Vec3;
  readonly high: Vec3;
  /** The reference viewpoint. */
  readonly centre: Vec3;
}

/** Distance from a point to a box, metres; 0 inside. */
export function boxDistance(low: Vec3, high: Vec3, point: Vec3): number {
  return Math.hypot(
    Math.max(low[0] - point[0], 0, point[0] - high[0]),
    Math.max(low[1] - point[1], 0, point[1] - high[1]),
    Math.max(low[2] - point[2], 0, point[2] - high[2]),
  );
}

export function cellDistance(cell: Cell, point: Vec3): number {
  return boxDistance(cell.low, cell.high, point);
}

/** Whether the cell's box, grown by `margin` on all sides, contains the point. */
export function cellContains(cell: Cell, point: Vec3, margin = 0): boolean {
  return [0, 1, 2].every(
    (axis) => point[axis] >= cell.low[axis] - margin && point[axis] <= cell.high[axis] + margin,
  );
}
