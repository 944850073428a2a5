/** In which order cells around a walker are wanted. */

import { boxDistance, type Cell } from './cells.js';
import type { Vec3 } from './format.js';

export interface Motion {
  readonly eye: Vec3;
  /** Metres per second. */
  readonly velocity: Vec3;
  /** Unit vector of the view direction. */
  readonly view: Vec3;
}

/** How far ahead the walker's path is extrapolated, seconds. */
const HORIZON = 4;
/** A cell straight behind counts as this much farther away than one straight ahead, in cells. */
const VIEW_WEIGHT = 0.3;

/**
 * Cost of a cell, in cell edges: 0 for the one the walker is in, then how far the cell is from the
 * walker and from where the walker will be, with a preference for what is in view.
 */
export function prefetchCost(cell: Cell, motion: Motion, size: Vec3): number {
  const scale = (v: Vec3): Vec3 => [v[0] / size[0], v[1] / size[1], v[2] / size[2]];
  const low = scale(cell.low);
  const high = scale(cell.high);
  const eye = scale(motion.eye);
  const velocity = scale(motion.velocity);
  const here = boxDistance(low, high, eye);
  if (here === 0) return 0;
  let ahead = here;
  const steps = 8;
  for (let n = 1; n <= steps; n++) {
    const t = (HORIZON * n) / steps;
    const later: Vec3 = [
      eye[0] + velocity[0] * t,
      eye[1] + velocity[1] * t,
      eye[2] + velocity[2] * t,
    ];
    // A place reached late is less pressing than one reached soon.
    ahead = Math.min(ahead, boxDistance(low, high, later) + 0.25 * (n / steps));
  }
  const towards = scale(cell.centre).map((c, axis) => c - eye[axis]);
  const length = Math.hypot(...towards);
  const view = scale(motion.view);
  const cosine =
    length === 0
      ? 1
      : towards.reduce((sum, t, axis) => sum + t * view[axis], 0) / (length * Math.hypot(...view));
  return 0.01 + 0.5 * here + ahead + VIEW_WEIGHT * 0.5 * (1 - cosine);
}

/** The cells in the order in which they should be loaded; ties keep the order of names. */
export function prefetchOrder(cells: Iterable<Cell>, motion: Motion, size: Vec3): Cell[] {
  return [...cells]
    .map((cell) => ({ cell, cost: prefetchCost(cell, motion, size) }))
    .sort((a, b) => a.cost - b.cost || (a.cell.name < b.cell.name ? -1 : 1))
    .map(({ cell }) => cell);
}
