/**
 * Which cells exist and where. Small corridors list them in walk.json; large ones in pages, of
 * which only those near the walker are loaded, so a million cells cost no more than a thousand.
 */

import { boxDistance, cellDistance, type Cell } from './cells.js';
import { CellLookup } from './cell-table.js';
import { FarfieldError } from './errors.js';
import type { CellPage, CellTable, Vec3, WalkGrid } from './format.js';

interface Page {
  readonly page: CellPage;
  lookup: CellLookup | undefined;
  loading: Promise<void> | undefined;
}

export class CellIndex {
  readonly grid: WalkGrid;
  private readonly pages: Page[];
  private readonly loadPage: (href: string) => Promise<CellTable>;
  private readonly maxPages: number;

  /**
   * @param loadPage fetches a page of the cell table by its `href`
   * @param maxPages how many pages are kept; those farthest from the walker are dropped
   */
  constructor(
    grid: WalkGrid,
    loadPage: (href: string) => Promise<CellTable> = () =>
      Promise.reject(new FarfieldError('format', 'This walk has no pages.')),
    maxPages = 64,
  ) {
    this.grid = grid;
    this.loadPage = loadPage;
    this.maxPages = maxPages;
    const everywhere = {
      min: [-Infinity, -Infinity, -Infinity],
      max: [Infinity, Infinity, Infinity],
    } as const;
    this.pages =
      grid.cells === undefined || grid.cells === null
        ? (grid.pages ?? []).map((page) => ({ page, lookup: undefined, loading: undefined }))
        : [
            {
              page: { href: '', cells: grid.total, bounds: everywhere },
              lookup: new CellLookup(grid, grid.cells),
              loading: undefined,
            },
          ];
  }

  /** The shortest edge of a cell. */
  get cellSize(): number {
    return Math.min(...this.grid.size);
  }

  /** Pages held now. */
  get loadedPages(): number {
    return this.pages.filter((page) => page.lookup !== undefined).length;
  }

  /** Load the pages whose cells may come within `radius` of the point, the nearest page first. */
  async ensure(point: Vec3, radius: number): Promise<void> {
    const distance = (page: Page): number =>
      boxDistance(page.page.bounds.min, page.page.bounds.max, point);
    const reach = radius + 1e-6 * this.cellSize;
    const wanted = this.pages.filter((page) => distance(page) <= reach);
    const missing = wanted.filter((page) => page.lookup === undefined);
    if (missing.length === 0) return;
    missing.sort((a, b) => distance(a) - distance(b));
    await Promise.all(missing.map((page) => this.load(page)));
    const held = this.pages.filter((page) => page.lookup !== undefined);
    if (held.length <= this.maxPages) return;
    held.sort((a, b) => distance(b) - distance(a));
    for (const page of held.slice(0, held.length - this.maxPages)) {
      if (!wanted.includes(page)) page.lookup = undefined;
    }
  }

  /** Load what it takes for `nearest` to find the nearest cell, wherever that is. */
  async ensureNearest(point: Vec3): Promise<void> {
    const distances = this.pages.map(({ page }) =>
      boxDistance(page.bounds.min, page.bounds.max, point),
    );
    await this.ensure(point, Math.min(...distances));
    // A page's bounds may be nearer than its cells are, and another page's cells nearer still.
    const found = this.nearest(point);
    if (found !== undefined) await this.ensure(point, cellDistance(found, point));
  }

  /** The cell that contains the point, if it exists and its page is loaded. */
  at(point: Vec3): Cell | undefined {
    for (const lookup of this.lookups(point, 0)) {
      const cell = lookup.at(point);
      if (cell !== undefined) return cell;
    }
    return undefined;
  }

  /** The loaded cells of the column above lattice place (i, k). */
  column(i: number, k: number): Cell[] {
    return this.pages.flatMap(({ lookup }) => lookup?.column(i, k) ?? []);
  }

  /** All loaded cells whose boxes come within `radius` of the point. */
  near(point: Vec3, radius: number): Cell[] {
    return this.lookups(point, radius).flatMap((lookup) => lookup.near(point, radius));
  }

  /** The loaded cell nearest to the point; `at` if there is one. */
  nearest(point: Vec3): Cell | undefined {
    const inside = this.at(point);
    if (inside !== undefined) return inside;
    let best: { cell: Cell; distance: number } | undefined;
    for (const lookup of this.lookups(point, Infinity)) {
      const found = lookup.nearest(point);
      if (found !== undefined && (best === undefined || found.distance < best.distance)) {
        best = found;
      }
    }
    return best?.cell;
  }

  /** Every cell that can be listed without loading anything. */
  *loaded(): IterableIterator<Cell> {
    for (const { lookup } of this.pages) {
      if (lookup === undefined) continue;
      for (let row = 0; row < lookup.size; row++) yield lookup.cell(row);
    }
  }

  private lookups(point: Vec3, radius: number): CellLookup[] {
    // Bounds are rounded: a point on a page's side may lie a hair outside them.
    const reach = radius + 1e-6 * this.cellSize;
    return this.pages.flatMap(({ page, lookup }) =>
      lookup !== undefined && boxDistance(page.bounds.min, page.bounds.max, point) <= reach
        ? [lookup]
        : [],
    );
  }

  private load(page: Page): Promise<void> {
    page.loading ??= this.loadPage(page.page.href)
      .then((table) => {
        page.lookup = new CellLookup(this.grid, table);
      })
      .finally(() => {
        page.loading = undefined;
      });
    return page.loading;
  }
}
