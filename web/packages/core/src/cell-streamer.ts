/**
 * Decides which cells to load, keep and show. Knows nothing of engines: `load` makes something
 * that can be shown out of a cell, and a cell exists here only when it is complete. A load must let
 * go of all it holds as soon as its signal aborts.
 */

import type { Cell } from './cells.js';
import type { CellIndex } from './cell-index.js';
import { shownCell, wantedCell } from './choice.js';
import { FarfieldError, asError, isAborted } from './errors.js';
import type { Vec3 } from './format.js';
import { prefetchOrder, type Motion } from './prefetch.js';

/** A complete cell. */
export interface Loaded<V> {
  readonly view: V;
  readonly bytes: number;
}

/** A cell being loaded. `priority` is its place in the order: 0 is where the walker is. */
export interface Job {
  readonly cell: Cell;
  readonly signal: AbortSignal;
  readonly priority: () => number;
}

export type CellState = 'ready' | 'loading' | 'absent' | 'failed';

export interface CellStreamerOptions<V> {
  readonly index: CellIndex;
  readonly load: (job: Job) => Promise<Loaded<V>>;
  readonly dispose: (view: V) => void;
  /** Bytes that all complete cells together may weigh. */
  readonly capacity: number;
  /** How many cells, the walker's own included, are wanted at once. */
  readonly prefetch: number;
  /** How many cells load at once beside the walker's own. */
  readonly concurrency?: number;
  /** Milliseconds, rising. */
  readonly now?: () => number;
  readonly onError?: (cell: Cell, error: Error) => void;
  readonly onReady?: (cell: Cell, seconds: number) => void;
}

interface Complete<V> extends Loaded<V> {
  readonly cell: Cell;
  used: number;
}

interface Trouble {
  readonly state: 'absent' | 'failed';
  readonly error: Error;
  readonly attempts: number;
  readonly retryAt: number;
}

const OUT_OF_ORDER = 1e6;

export class CellStreamer<V> {
  wanted: Cell | undefined;
  shown: Cell | undefined;
  /** Bytes of all complete cells. */
  bytes = 0;
  private readonly options: CellStreamerOptions<V>;
  private readonly complete = new Map<string, Complete<V>>();
  private readonly loading = new Map<string, AbortController>();
  private readonly trouble = new Map<string, Trouble>();
  private ranks = new Map<string, number>();
  private order: Cell[] = [];
  /** No prefetch from this place in the order on: what it would need does not fit. */
  private full = Infinity;
  private disposed = false;

  constructor(options: CellStreamerOptions<V>) {
    this.options = options;
  }

  /** Look at where the walker is; start, stop and drop loads; return what to show. */
  update(motion: Motion): V | undefined {
    const { index } = this.options;
    const wanted = wantedCell(index, motion.eye, this.wanted);
    if (wanted?.name !== this.wanted?.name) this.full = Infinity;
    this.wanted = wanted;
    this.rank(motion);
    this.stopUnwanted();
    this.startWanted();
    const cells = [...this.complete.values()].map(({ cell }) => cell);
    this.shown = shownCell(motion.eye, wanted, this.shown, cells);
    return this.shown === undefined ? undefined : this.complete.get(this.shown.name)?.view;
  }

  /** Whether the cell that should be seen is the one that is shown. */
  get settled(): boolean {
    return this.wanted !== undefined && this.shown?.name === this.wanted.name;
  }

  state(name: string): CellState | undefined {
    if (this.complete.has(name)) return 'ready';
    if (this.loading.has(name)) return 'loading';
    return this.trouble.get(name)?.state;
  }

  /** What went wrong with a cell last. */
  error(name: string): Error | undefined {
    return this.trouble.get(name)?.error;
  }

  count(state: 'ready' | 'loading'): number {
    return state === 'ready' ? this.complete.size : this.loading.size;
  }

  /** Whether nothing is being loaded. */
  get idle(): boolean {
    return this.loading.size === 0;
  }

  /**
   * Give up the least useful cell that matters less than `priority`, complete or loading; false if
   * there is none. What is wanted stays, and so does what is shown, unless the wanted cell itself
   * finds no room beside it: a moment without a far field is better than the wrong one for ever.
   */
  evict(priority: number): boolean {
    let worst: Complete<V> | undefined;
    for (const candidate of this.complete.values()) {
      const { name } = candidate.cell;
      if (name === this.shown?.name || name === this.wanted?.name) continue;
      if (this.rankOf(name) <= priority) continue;
      if (worst === undefined || this.lessUseful(candidate, worst)) worst = candidate;
    }
    const last = [...this.loading.keys()].sort((a, b) => this.rankOf(b) - this.rankOf(a)).at(0);
    const lastRank = last === undefined ? -1 : this.rankOf(last);
    if (worst !== undefined && this.rankOf(worst.cell.name) >= lastRank) {
      this.drop(worst);
      return true;
    }
    if (last === undefined || lastRank <= priority) return priority === 0 && this.dropShown();
    this.loading.get(last)?.abort();
    this.loading.delete(last);
    this.full = Math.min(this.full, lastRank);
    return true;
  }

  private dropShown(): boolean {
    const name = this.shown?.name;
    const complete = name === undefined ? undefined : this.complete.get(name);
    if (complete === undefined || name === this.wanted?.name) return false;
    this.drop(complete);
    this.shown = undefined;
    return true;
  }

  /** Try again at once what failed or was absent. */
  retry(): void {
    this.trouble.clear();
    this.full = Infinity;
  }

  /** Forget everything that was loaded, as after a lost context. */
  reset(): void {
    for (const abort of this.loading.values()) abort.abort();
    this.loading.clear();
    for (const complete of [...this.complete.values()]) this.drop(complete);
    this.shown = undefined;
    this.retry();
  }

  dispose(): void {
    this.disposed = true;
    this.reset();
  }

  private get now(): number {
    return this.options.now === undefined ? performance.now() : this.options.now();
  }

  private rankOf(name: string): number {
    return this.ranks.get(name) ?? OUT_OF_ORDER;
  }

  private lessUseful(a: Complete<V>, b: Complete<V>): boolean {
    const [rankA, rankB] = [this.rankOf(a.cell.name), this.rankOf(b.cell.name)];
    return rankA === rankB ? a.used < b.used : rankA > rankB;
  }

  private rank(motion: Motion): void {
    const { index, prefetch } = this.options;
    const { size } = index.grid;
    const around = index.near(motion.eye, reach(motion.velocity, size));
    const order = prefetchOrder(around, motion, size).filter(
      (cell) => cell.name !== this.wanted?.name,
    );
    if (this.wanted !== undefined) order.unshift(this.wanted);
    this.order = order.slice(0, prefetch);
    this.ranks = new Map(this.order.map((cell, rank) => [cell.name, rank]));
    const { now } = this;
    for (const { name } of this.order) {
      const complete = this.complete.get(name);
      if (complete !== undefined) complete.used = now;
    }
  }

  private stopUnwanted(): void {
    for (const [name, abort] of this.loading) {
      if (!this.ranks.has(name)) {
        this.loading.delete(name);
        abort.abort();
      }
    }
  }

  private startWanted(): void {
    const concurrency = this.options.concurrency ?? 2;
    const { now } = this;
    for (const [rank, cell] of this.order.entries()) {
      const state = this.state(cell.name);
      if (state === 'ready' || state === 'loading') {
        // Neighbours wait until the walker's own cell is there.
        if (rank === 0 && state === 'loading') return;
        continue;
      }
      if (rank >= this.full || (rank > 0 && this.loading.size >= concurrency)) return;
      const trouble = this.trouble.get(cell.name);
      if (now < (trouble?.retryAt ?? 0)) {
        // Neighbours would only take the memory that the walker's own cell lacks.
        if (rank === 0 && isTooLarge(trouble?.error)) return;
        continue;
      }
      void this.start(cell);
      if (rank === 0) return;
    }
  }

  private async start(cell: Cell): Promise<void> {
    const { name } = cell;
    const abort = new AbortController();
    this.loading.set(name, abort);
    const started = this.now;
    const priority = (): number => this.rankOf(name);
    try {
      const loaded = await this.options.load({ cell, signal: abort.signal, priority });
      if (abort.signal.aborted || !this.admit(cell, loaded)) {
        this.options.dispose(loaded.view);
        if (!abort.signal.aborted) {
          throw new FarfieldError('too-large', `There is no memory left for cell ${name}.`);
        }
        return;
      }
      this.trouble.delete(name);
      this.options.onReady?.(cell, (this.now - started) / 1000);
    } catch (error) {
      if (!abort.signal.aborted && !isAborted(error) && !this.disposed) {
        this.note(cell, asError(error));
      }
    } finally {
      if (this.loading.get(name) === abort) this.loading.delete(name);
    }
  }

  private admit(cell: Cell, loaded: Loaded<V>): boolean {
    while (this.bytes + loaded.bytes > this.options.capacity) {
      if (!this.evict(this.rankOf(cell.name))) return false;
    }
    this.bytes += loaded.bytes;
    this.complete.set(cell.name, { ...loaded, cell, used: this.now });
    return true;
  }

  private note(cell: Cell, error: Error): void {
    const rank = this.rankOf(cell.name);
    if (isTooLarge(error) && rank > 0) {
      this.full = Math.min(this.full, rank);
      return;
    }
    const absent = error instanceof FarfieldError && error.code === 'not-found';
    const attempts = (this.trouble.get(cell.name)?.attempts ?? 0) + 1;
    const wait = absent
      ? Math.min(15_000, 1000 * 1.5 ** attempts)
      : Math.min(60_000, 2000 * 2 ** attempts);
    this.trouble.set(cell.name, {
      state: absent ? 'absent' : 'failed',
      error,
      attempts,
      retryAt: this.now + wait,
    });
    this.options.onError?.(cell, error);
  }

  private drop(complete: Complete<V>): void {
    this.complete.delete(complete.cell.name);
    this.bytes -= complete.bytes;
    this.options.dispose(complete.view);
  }
}

function isTooLarge(error: Error | undefined): boolean {
  return error instanceof FarfieldError && error.code === 'too-large';
}

/** How far around the walker cells are looked at: three and a half cells, more at speed. */
function reach(velocity: Vec3, size: Vec3): number {
  return 3.5 * Math.max(...size) + Math.min(4 * Math.max(...size), 3 * Math.hypot(...velocity));
}
