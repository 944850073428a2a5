/** Which cell a walker should see: hysteresis at borders, and the best stand-in while one loads. */

import { cellContains, cellDistance, type Cell } from './cells.js';
import type { CellIndex } from './cell-index.js';
import type { Vec3 } from './format.js';

/** How far past a border the old cell is kept, as a share of the shortest edge. */
export const HYSTERESIS = 0.03;

/** The cell that should be shown at `eye`: the current one until its border is clearly passed. */
export function wantedCell(index: CellIndex, eye: Vec3, current?: Cell): Cell | undefined {
  if (current !== undefined && cellContains(current, eye, HYSTERESIS * index.cellSize)) {
    return current;
  }
  return index.nearest(eye);
}

/**
 * The cell to show now: `wanted` if it is complete, otherwise the complete cell nearest to the eye;
 * `shown` stays if nothing is nearer.
 */
export function shownCell(
  eye: Vec3,
  wanted: Cell | undefined,
  shown: Cell | undefined,
  complete: Iterable<Cell>,
): Cell | undefined {
  let best = shown;
  let bestDistance = shown === undefined ? Infinity : cellDistance(shown, eye);
  for (const cell of complete) {
    if (cell.name === wanted?.name) return cell;
    const distance = cellDistance(cell, eye);
    if (distance < bestDistance) {
      best = cell;
      bestDistance = distance;
    }
  }
  return best;
}
