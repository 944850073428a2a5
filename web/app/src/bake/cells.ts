/** The cells of a bake as squares on the map. */

import type { Area } from '../map/view.js';

export interface Square {
  readonly name: string;
  readonly x: number;
  readonly z: number;
}

export interface Squares {
  readonly size: readonly [number, number];
  readonly all: readonly Square[];
  readonly area: Area;
}

interface Table {
  readonly i: readonly number[];
  readonly j: readonly number[];
  readonly k: readonly number[];
}

export interface Grid {
  readonly origin: readonly [number, number, number];
  readonly size: readonly [number, number, number];
  readonly cells?: Table | null;
  readonly pages?: readonly { readonly href: string }[];
}

/** All cells of a grid; `read` fetches a page of a large one. */
export async function squaresOf(
  grid: Grid,
  read: (href: string) => Promise<Table>,
): Promise<Squares> {
  const { origin, size } = grid;
  const tables = grid.cells ? [grid.cells] : [];
  for (const page of grid.pages ?? []) tables.push(await read(page.href));
  const all = tables.flatMap(({ i, j, k }) =>
    i.map((_, row) => ({
      name: `${i[row]}_${j[row]}_${k[row]}`,
      x: origin[0] + i[row] * size[0],
      z: origin[2] + k[row] * size[2],
    })),
  );
  const min: [number, number] = [Infinity, Infinity];
  const max: [number, number] = [-Infinity, -Infinity];
  for (const { x, z } of all) {
    min[0] = Math.min(min[0], x);
    min[1] = Math.min(min[1], z);
    max[0] = Math.max(max[0], x + size[0]);
    max[1] = Math.max(max[1], z + size[2]);
  }
  return { size: [size[0], size[2]], all, area: { min, max } };
}
