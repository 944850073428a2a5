/**
 * Objects in a cell's near field. Near blocks are cut by place, not by object, so objects are found
 * again from the triangles: those that share a vertex hang together, and pieces of which one lies for
 * the most part within the other's box, as leaves and their trunk do, are one object. What is larger than `largest` or reaches out of the
 * near field, such as the ground, stays as it is.
 */

import type { Bounds } from '../format.js';

/** Triangles of one draw state: 3 numbers per vertex, and corners. */
export interface Triangles {
  readonly positions: Float32Array<ArrayBuffer>;
  readonly indices: Uint32Array<ArrayBuffer>;
}

export interface FoundObject {
  /** Relative to the cell's centre. */
  readonly bounds: Bounds;
  readonly triangles: number;
  /** Index ranges: batch, first index, number of indices. */
  readonly ranges: readonly (readonly [batch: number, first: number, count: number])[];
}

export interface FoundObjects {
  readonly objects: readonly FoundObject[];
  /** Each batch's indices in a new order: first `rest` that belong to no object, then the objects'. */
  readonly batches: readonly { indices: Uint32Array<ArrayBuffer>; rest: number }[];
}

export interface FindOptions {
  /** Half width of the near field; an object must lie inside. */
  readonly nearField: number;
  /** Longest edge of an object's box. */
  readonly largest: number;
  /** Fewest triangles that are worth a picture. */
  readonly fewest: number;
}

interface Piece {
  low: [number, number, number];
  high: [number, number, number];
  /** Whether it may be part of an object. */
  movable: boolean;
}

class Sets {
  private readonly parents: Uint32Array;

  constructor(count: number) {
    this.parents = Uint32Array.from({ length: count }, (_, n) => n);
  }

  find(n: number): number {
    const { parents } = this;
    while (parents[n] !== n) {
      parents[n] = parents[parents[n]];
      n = parents[n];
    }
    return n;
  }

  join(a: number, b: number): void {
    const [x, y] = [this.find(a), this.find(b)];
    this.parents[Math.max(x, y)] = Math.min(x, y);
  }
}

/** Find objects and sort every batch's indices by them. */
export function findObjects(batches: readonly Triangles[], options: FindOptions): FoundObjects {
  const pieces: Piece[] = [];
  // Triangle -> piece, by batch.
  const owners = batches.map((batch) => findPieces(batch, pieces, options));
  const object = joinPieces(pieces, options);
  const counts = new Map<number, number>();
  for (const owner of owners) {
    for (const piece of owner) {
      if (object[piece] >= 0) counts.set(object[piece], (counts.get(object[piece]) ?? 0) + 1);
    }
  }
  const kept = new Map<number, number>();
  for (const [root, count] of counts) if (count >= options.fewest) kept.set(root, kept.size);
  const ranges = Array.from({ length: kept.size }, (): [number, number, number][] => []);
  const sorted = batches.map(({ indices }, number) => {
    // Counting sort by object; what belongs to none comes first.
    const bins = Array.from(owners[number], (piece) => (kept.get(object[piece]) ?? -1) + 1);
    const starts = new Uint32Array(kept.size + 2);
    for (const bin of bins) starts[bin + 1] += 3;
    for (let bin = 0; bin <= kept.size; bin++) starts[bin + 1] += starts[bin];
    for (let bin = 1; bin <= kept.size; bin++) {
      const count = starts[bin + 1] - starts[bin];
      if (count > 0) ranges[bin - 1].push([number, starts[bin], count]);
    }
    const rest = starts[1];
    const order = new Uint32Array(indices.length);
    bins.forEach((bin, triangle) => {
      for (let corner = 0; corner < 3; corner++) {
        order[starts[bin]++] = indices[3 * triangle + corner];
      }
    });
    return { indices: order, rest };
  });
  const objects = [...kept].map(([root, number]) => ({
    bounds: { min: pieces[root].low, max: pieces[root].high },
    triangles: counts.get(root) ?? 0,
    ranges: ranges[number],
  }));
  return { objects, batches: sorted };
}

/** Pieces that hang together by place; adds them to `pieces` and returns each triangle's. */
function findPieces(
  { positions, indices }: Triangles,
  pieces: Piece[],
  { nearField, largest }: FindOptions,
): Uint32Array {
  const vertices = positions.length / 3;
  const sets = new Sets(vertices);
  // Vertices that differ in normal or texture coordinates alone are one place.
  const places = new Map<string, number>();
  for (let n = 0; n < vertices; n++) {
    const key = `${positions[3 * n]},${positions[3 * n + 1]},${positions[3 * n + 2]}`;
    const first = places.get(key);
    if (first === undefined) places.set(key, n);
    else sets.join(first, n);
  }
  for (let n = 0; n < indices.length; n += 3) {
    sets.join(indices[n], indices[n + 1]);
    sets.join(indices[n], indices[n + 2]);
  }
  const numbers = new Map<number, number>();
  const owner = new Uint32Array(indices.length / 3);
  for (let triangle = 0; triangle < owner.length; triangle++) {
    const root = sets.find(indices[3 * triangle]);
    let number = numbers.get(root);
    if (number === undefined) {
      number = pieces.length;
      numbers.set(root, number);
      pieces.push({
        low: [Infinity, Infinity, Infinity],
        high: [-Infinity, -Infinity, -Infinity],
        movable: true,
      });
    }
    owner[triangle] = number;
    const { low, high } = pieces[number];
    for (let corner = 0; corner < 3; corner++) {
      const vertex = indices[3 * triangle + corner];
      for (let axis = 0; axis < 3; axis++) {
        const value = positions[3 * vertex + axis];
        low[axis] = Math.min(low[axis], value);
        high[axis] = Math.max(high[axis], value);
      }
    }
  }
  for (const number of numbers.values()) {
    const { low, high } = pieces[number];
    const fits = [0, 1, 2].every(
      (axis) =>
        high[axis] - low[axis] <= largest && high[axis] < nearField && low[axis] > -nearField,
    );
    pieces[number].movable = fits;
  }
  return owner;
}

/**
 * Join movable pieces whose boxes share most of the smaller one while the whole stays small enough; boxes of roots grow.
 * Returns the root of each piece, -1 for those that cannot move.
 */
function joinPieces(pieces: readonly Piece[], { largest }: FindOptions): Int32Array {
  const sets = new Sets(pieces.length);
  const movable = pieces.map((_, n) => n).filter((n) => pieces[n].movable);
  const joined = (a: Piece, b: Piece): boolean =>
    [0, 1, 2].every((axis) => {
      const overlap = Math.min(a.high[axis], b.high[axis]) - Math.max(a.low[axis], b.low[axis]);
      const smaller = Math.min(a.high[axis] - a.low[axis], b.high[axis] - b.low[axis]);
      const whole = Math.max(a.high[axis], b.high[axis]) - Math.min(a.low[axis], b.low[axis]);
      // Less than half, and they are neighbours that touch.
      return overlap >= smaller / 2 && whole <= largest;
    });
  for (let changed = true; changed;) {
    changed = false;
    // Sweep along x: only boxes that are open at the same time can overlap.
    const roots = movable.filter((n) => sets.find(n) === n);
    roots.sort((a, b) => pieces[a].low[0] - pieces[b].low[0]);
    let open: number[] = [];
    for (const n of roots) {
      open = open.filter((other) => pieces[other].high[0] >= pieces[n].low[0]);
      let box = n;
      for (const other of open) {
        const [a, b] = [sets.find(other), sets.find(box)];
        if (a === b || !joined(pieces[a], pieces[b])) continue;
        sets.join(a, b);
        const root = sets.find(a);
        const gone = root === a ? b : a;
        for (let axis = 0; axis < 3; axis++) {
          pieces[root].low[axis] = Math.min(pieces[root].low[axis], pieces[gone].low[axis]);
          pieces[root].high[axis] = Math.max(pieces[root].high[axis], pieces[gone].high[axis]);
        }
        box = root;
        changed = true;
      }
      open.push(n);
    }
  }
  return Int32Array.from(pieces, ({ movable: moves }, n) => (moves ? sets.find(n) : -1));
}
