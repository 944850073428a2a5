/**
 * Copies of objects that repeat, among a cell's near triangles: which of them can be drawn from height
 * fields (Risser) instead of polygons, and triangles in such an order that drawing fewer of them leaves
 * out just those copies.
 */

import { FarfieldError } from '../errors.js';
import type { Vec3 } from '../format.js';
import type { Glb } from '../glb.js';
import { switchDistance, type ObjectFile } from './object-file.js';
import { add, cross, scale } from './vectors.js';

/** One copy of an object. */
export interface Copy {
  /** Name of its object file, beside the near blocks. */
  readonly shape: string;
  /** Where its origin is, scene coordinates, and its scale. */
  readonly place: readonly [number, number, number, number];
  /** Unit quaternion. */
  readonly turn: readonly [number, number, number, number];
}

/** Numbers the copies of several near blocks; a copy may have triangles in more than one. */
export class CopyList {
  readonly copies: Copy[] = [];
  private readonly numbers = new Map<string, number>();

  /** The numbers of a block's copies; throws FarfieldError 'format'. */
  add({ json }: Glb): number[] {
    const { shapes = [], shape = [], places = [], turns = [] } = json.extras?.objects ?? {};
    if (places.length !== 4 * shape.length || turns.length !== 4 * shape.length) {
      throw new FarfieldError('format', 'A near block has columns of copies of unequal length.');
    }
    return shape.map((index, n) => {
      const name = shapes.at(index);
      if (name === undefined) {
        throw new FarfieldError('format', 'A near block has a copy of an object it does not name.');
      }
      const [x, y, z, size] = places.slice(4 * n, 4 * n + 4);
      const [a, b, c, w] = turns.slice(4 * n, 4 * n + 4);
      const copy: Copy = { shape: name, place: [x, y, z, size], turn: [a, b, c, w] };
      const key = JSON.stringify(copy);
      const known = this.numbers.get(key);
      if (known !== undefined) return known;
      this.numbers.set(key, this.copies.length);
      return this.copies.push(copy) - 1;
    });
  }
}

/** A point of an object's space in the scene. */
export function placePoint({ place, turn }: Copy, point: Vec3): Vec3 {
  const axis: Vec3 = [turn[0], turn[1], turn[2]];
  const inner = add(cross(axis, point), scale(point, turn[3]));
  const turned = add(point, scale(cross(axis, inner), 2));
  return add([place[0], place[1], place[2]], scale(turned, place[3]));
}

/** A view cell and its near field. */
export interface CellSpace {
  readonly centre: Vec3;
  readonly size: Vec3;
  readonly nearField: number;
}

/**
 * The longest focal length, in pixels per unit of slope, at which a copy may be drawn from height
 * fields from everywhere in the cell: there its error is a pixel. 0 if it may never: part of it
 * reaches out of the near field, where quads show it.
 */
export function switchFocal(copy: Copy, file: ObjectFile, cell: CellSpace): number {
  const { low, high } = file;
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n): Vec3 => {
    const corner: Vec3 = [
      n & 1 ? high[0] : low[0],
      n & 2 ? high[1] : low[1],
      n & 4 ? high[2] : low[2],
    ];
    return placePoint(copy, corner);
  });
  const gaps = ([0, 1, 2] as const).map((axis) => {
    const values = corners.map((corner) => corner[axis] - cell.centre[axis]);
    const [least, most] = [Math.min(...values), Math.max(...values)];
    if (least < -cell.nearField || most > cell.nearField) return undefined;
    return Math.max(0, least - cell.size[axis] / 2, -cell.size[axis] / 2 - most);
  });
  if (gaps.includes(undefined)) return 0;
  const distance = Math.hypot(...gaps.map((gap) => gap ?? 0));
  return distance / switchDistance(file, 1, copy.place[3]);
}

/** Triangles, and which copy each belongs to. */
export interface OwnedTriangles {
  readonly indices: Uint32Array<ArrayBuffer>;
  /** Number of a copy for each triangle, -1 for none; empty where there are no copies. */
  readonly owners: Int32Array<ArrayBuffer>;
}

/**
 * Sort triangles in place: first those of no copy, then those of `order[0]`, `order[1]` and so on; what
 * stood before stays before.
 *
 * @param order all copies' numbers
 * @returns corners up to and with the first k copies, for k from 0 to their number
 */
export function sortByCopy(
  { indices, owners }: OwnedTriangles,
  order: readonly number[],
): Uint32Array<ArrayBuffer> {
  const ranks = new Uint32Array(order.length);
  order.forEach((copy, rank) => (ranks[copy] = rank + 1));
  const rank = Uint32Array.from({ length: indices.length / 3 }, (_, n) =>
    owners.length === 0 || owners[n] < 0 ? 0 : ranks[owners[n]],
  );
  const ends = new Uint32Array(order.length + 1);
  for (const one of rank) ends[one] += 3;
  for (let n = 1; n < ends.length; n++) ends[n] += ends[n - 1];
  const next = Uint32Array.from(ends, (_, n) => (n === 0 ? 0 : ends[n - 1]));
  const source = indices.slice();
  rank.forEach((one, n) => {
    indices.set(source.subarray(3 * n, 3 * n + 3), next[one]);
    next[one] += 3;
  });
  return ends;
}
