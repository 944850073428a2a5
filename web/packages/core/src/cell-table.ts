/** A table of cells by column, searchable by place. */

import { boxDistance, type Cell } from './cells.js';
import type { CellTable, Vec3, WalkGrid } from './format.js';

const HALF = 2 ** 25;

/** A number for the vertical column of cells above (i, k); exact for indices within 2^25. */
function columnKey(i: number, k: number): number {
  return (i + HALF) * 2 * HALF + (k + HALF);
}

export class CellLookup {
  private readonly grid: WalkGrid;
  private readonly table: CellTable;
  private readonly columns = new Map<number, number[]>();
  private readonly cells = new Map<number, Cell>();

  constructor(grid: WalkGrid, table: CellTable) {
    this.grid = grid;
    this.table = table;
    for (let row = 0; row < table.i.length; row++) {
      const key = columnKey(table.i[row], table.k[row]);
      const column = this.columns.get(key);
      if (column === undefined) this.columns.set(key, [row]);
      else column.push(row);
    }
  }

  get size(): number {
    return this.table.i.length;
  }

  /** The cell of a row of the table. */
  cell(row: number): Cell {
    const known = this.cells.get(row);
    if (known !== undefined) return known;
    const { origin, size } = this.grid;
    const [i, j, k] = [this.table.i[row], this.table.j[row], this.table.k[row]];
    const low: Vec3 = [origin[0] + i * size[0], this.table.y[row], origin[2] + k * size[2]];
    const cell: Cell = {
      name: `${i}_${j}_${k}`,
      index: [i, j, k],
      low,
      high: [low[0] + size[0], low[1] + size[1], low[2] + size[2]],
      centre: [low[0] + size[0] / 2, low[1] + size[1] / 2, low[2] + size[2] / 2],
    };
    this.cells.set(row, cell);
    return cell;
  }

  /** The cells of the column above lattice place (i, k). */
  column(i: number, k: number): Cell[] {
    return (this.columns.get(columnKey(i, k)) ?? []).map((row) => this.cell(row));
  }

  /** The cell that contains the point; a cell owns its lower sides. */
  at(point: Vec3): Cell | undefined {
    const { origin, size } = this.grid;
    const i = Math.floor((point[0] - origin[0]) / size[0]);
    const k = Math.floor((point[2] - origin[2]) / size[2]);
    return this.column(i, k).find((cell) => point[1] >= cell.low[1] && point[1] < cell.high[1]);
  }

  /** All cells whose boxes come within `radius` of the point, in no particular order. */
  near(point: Vec3, radius: number): Cell[] {
    const { origin, size } = this.grid;
    const found: Cell[] = [];
    const visit = (cell: Cell): void => {
      if (boxDistance(cell.low, cell.high, point) <= radius) found.push(cell);
    };
    const [i0, i1] = [point[0] - radius, point[0] + radius].map((x) =>
      Math.floor((x - origin[0]) / size[0]),
    );
    const [k0, k1] = [point[2] - radius, point[2] + radius].map((z) =>
      Math.floor((z - origin[2]) / size[2]),
    );
    // A cell that only touches the range from below is one column further out.
    if ((i1 - i0 + 2) * (k1 - k0 + 2) > this.columns.size) {
      for (let row = 0; row < this.size; row++) visit(this.cell(row));
    } else {
      for (let i = i0 - 1; i <= i1; i++) {
        for (let k = k0 - 1; k <= k1; k++) this.column(i, k).forEach(visit);
      }
    }
    return found;
  }

  /** The cell whose box is nearest to the point, and how far it is. Looks at every row. */
  nearest(point: Vec3): { cell: Cell; distance: number } | undefined {
    const { origin, size } = this.grid;
    const { i, k, y } = this.table;
    let best = -1;
    let bestDistance = Infinity;
    for (let row = 0; row < i.length; row++) {
      const x = origin[0] + i[row] * size[0];
      const z = origin[2] + k[row] * size[2];
      const dx = Math.max(x - point[0], 0, point[0] - x - size[0]);
      const dy = Math.max(y[row] - point[1], 0, point[1] - y[row] - size[1]);
      const dz = Math.max(z - point[2], 0, point[2] - z - size[2]);
      const distance = dx * dx + dy * dy + dz * dz;
      if (distance < bestDistance) {
        best = row;
        bestDistance = distance;
      }
    }
    return best < 0 ? undefined : { cell: this.cell(best), distance: Math.sqrt(bestDistance) };
  }
}
