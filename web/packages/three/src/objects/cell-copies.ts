/**
 * Objects that repeat in a cell's near field, as true impostors where their error is below a pixel
 * from everywhere in the cell, and as polygons where it is not. Which ones that is depends on how many
 * pixels a view has, so copies are ordered by it, and both are drawn up to or from one of them.
 */

import {
  sortByCopy,
  switchFocal,
  type CellSpace,
  type Copy,
  type Light,
  type NearBatch,
} from '@farfield/core';
import type { IUniform } from 'three';
import type { WalkMesh } from '../cell-view.js';
import { TrueImpostors, type BakedObject } from './true-impostors.js';

/** Steps of a ray for each pixel: open sheets are as thin as a texel. */
const STEPS_PER_PIXEL = 1.5;

export interface CellCopiesOptions {
  readonly copies: readonly Copy[];
  /** Objects by name; what is missing stays polygons. */
  readonly shapes: ReadonlyMap<string, BakedObject>;
  readonly space: CellSpace;
  readonly light: Light;
  readonly fade: IUniform<number>;
}

interface Drawn {
  readonly mesh: TrueImpostors;
  /** Rank of each instance among all copies, falling. */
  readonly ranks: readonly number[];
}

export class CellCopies {
  /** One mesh per object. */
  readonly meshes: readonly TrueImpostors[];
  private readonly drawn: readonly Drawn[];
  /** The longest focal length for each copy, rising. */
  private readonly focals: readonly number[];
  /** For each batch, corners of what is drawn as polygons if the first k copies are. */
  private readonly ends: readonly Uint32Array[];

  /** Sorts the triangles of `batches`. */
  constructor(batches: readonly NearBatch[], options: CellCopiesOptions) {
    const { copies, shapes, space } = options;
    const focals = copies.map((copy) => {
      const baked = shapes.get(copy.shape);
      return baked === undefined ? 0 : switchFocal(copy, baked.file, space);
    });
    const order = focals.map((_, n) => n).sort((a, b) => focals[a] - focals[b] || a - b);
    this.focals = order.map((copy) => focals[copy]);
    this.ends = batches.map((batch) => sortByCopy(batch, order));
    this.drawn = [...shapes].flatMap(([name, baked]) => {
      const ranks = order.flatMap((copy, rank) =>
        copies[copy].shape === name && focals[copy] > 0 ? [rank] : [],
      );
      ranks.reverse();
      return ranks.length === 0 ? [] : [{ ranks, mesh: draw(baked, ranks, order, options) }];
    });
    this.meshes = this.drawn.map(({ mesh }) => mesh);
  }

  /**
   * Draw from height fields what is good enough at a focal length, pixels per unit of slope; Infinity:
   * all as polygons. Returns how many copies are.
   */
  show(near: readonly WalkMesh[], focal: number): number {
    const polygons = this.focals.filter((most) => !(most > 0 && focal <= most)).length;
    near.forEach(({ geometry }, n) => {
      geometry.setDrawRange(0, this.ends[n][polygons]);
    });
    let count = 0;
    for (const { mesh, ranks } of this.drawn) {
      const shown = ranks.filter((rank) => rank >= polygons).length;
      mesh.geometry.instanceCount = shown;
      mesh.visible = shown > 0;
      count += shown;
    }
    return count;
  }

  dispose(): void {
    for (const mesh of this.meshes) mesh.dispose();
  }
}

function draw(
  baked: BakedObject,
  ranks: readonly number[],
  order: readonly number[],
  { copies, space, light, fade }: CellCopiesOptions,
): TrueImpostors {
  const places = new Float32Array(4 * ranks.length);
  const turns = new Float32Array(4 * ranks.length);
  ranks.forEach((rank, n) => {
    const { place, turn } = copies[order[rank]];
    const [x, y, z] = [0, 1, 2].map((axis) => place[axis] - space.centre[axis]);
    places.set([x, y, z, place[3]], 4 * n);
    turns.set(turn, 4 * n);
  });
  const mesh = new TrueImpostors(baked, places, turns, {
    light,
    fade,
    steps: Math.ceil(STEPS_PER_PIXEL * baked.file.resolution * Math.sqrt(3)),
    stepsPerPixel: STEPS_PER_PIXEL,
  });
  // After all polygons, which are cheaper to draw, and before the quads behind them.
  mesh.renderOrder = 0.999;
  mesh.visible = false;
  return mesh;
}
