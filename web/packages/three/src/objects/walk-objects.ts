/** Object impostors of a walk: the objects placed in it, and what is costly in the near field. */

import { Trial, type CellBuilder, type FindOptions } from '@farfield/core';
import type { Camera, Group, Object3D, WebGLRenderer } from 'three';
import type { CellView } from '../cell-view.js';
import { NearObjects } from './near-objects.js';
import type { ImpostorOptions } from './object-impostor.js';
import { ObjectImpostors, type ImpostorStats } from './object-impostors.js';

/**
 * How near-field objects are drawn: `never` as impostors, `always` as pictures that are taken now and
 * then, `copies`: those of which there are many from height fields, where their error is below a pixel.
 * `auto` tries all three and keeps what makes the shortest frames.
 */
export type NearImpostors = 'auto' | 'always' | 'copies' | 'never';

const WAYS: readonly NearImpostors[] = ['never', 'always', 'copies'];

export interface WalkObjectsOptions {
  readonly renderer: WebGLRenderer;
  readonly builder: CellBuilder;
  /** The walk's group. */
  readonly group: Group;
  near: NearImpostors;
}

/** Fewest triangles of a near-field object that are worth a picture. */
const FEWEST = 100;
/** Longest edge of a near-field object, as a share of the near field's half width. */
const LARGEST = 0.35;

export class WalkObjects {
  readonly impostors: ObjectImpostors;
  private readonly options: WalkObjectsOptions;
  private readonly trial = new Trial({ ways: WAYS.length });
  private copies = 0;
  private readonly found = new WeakMap<CellView, NearObjects | 'asked'>();
  private shown: NearObjects | undefined;
  private view: CellView | undefined;
  private last: number | undefined;

  constructor(options: WalkObjectsOptions) {
    this.options = options;
    this.impostors = new ObjectImpostors({ renderer: options.renderer });
    options.group.add(this.impostors.group);
  }

  /** Place an object in the walk and draw it as impostors where that is good enough. */
  add(object: Object3D, options?: ImpostorOptions): void {
    this.options.group.add(object);
    this.impostors.add(object, options);
  }

  remove(object: Object3D): void {
    this.impostors.remove(object);
    object.removeFromParent();
  }

  /** Call once a frame with the view that is shown. */
  update(view: CellView | undefined, nearField: number, camera: Camera, now: number): void {
    if (view !== this.view) {
      this.view = view;
      this.trial.restart();
    }
    const clock = performance.now() / 1000;
    if (this.last !== undefined) this.trial.frame(clock - this.last, clock);
    this.last = clock;
    const { way } = this;
    this.showNear(way === 'always' ? this.nearObjects(view, nearField) : undefined);
    this.copies = this.showCopies(view, way === 'copies' ? this.impostors.focal(camera) : Infinity);
    this.impostors.update(camera, now);
  }

  get stats(): ImpostorStats & { readonly copies: number } {
    return { ...this.impostors.stats, copies: this.copies };
  }

  /** How near-field objects are drawn now: what `auto` has come to. */
  get way(): NearImpostors {
    return this.options.near === 'auto' ? WAYS[this.trial.way] : this.options.near;
  }

  /** How near-field objects are drawn from the next frame on. */
  get near(): NearImpostors {
    return this.options.near;
  }

  set near(near: NearImpostors) {
    this.options.near = near;
  }

  /** The graphics context was lost; views are built anew. */
  forget(): void {
    this.showNear(undefined);
    this.view = undefined;
  }

  dispose(): void {
    this.showNear(undefined);
    this.impostors.dispose();
  }

  /** Returns how many copies are drawn from height fields. */
  private showCopies(view: CellView | undefined, focal: number): number {
    return view?.copies?.show(view.near, focal) ?? 0;
  }

  private showNear(next: NearObjects | undefined): void {
    const { shown, impostors } = this;
    if (shown === next) return;
    if (shown !== undefined) {
      for (const object of shown.objects) impostors.remove(object);
      shown.apart = false;
    }
    if (next !== undefined) {
      for (const object of next.objects) impostors.add(object);
      next.apart = true;
    }
    this.shown = next;
  }

  /** The view's objects, once they have been found. */
  private nearObjects(view: CellView | undefined, nearField: number): NearObjects | undefined {
    if (view === undefined) return undefined;
    const found = this.found.get(view);
    if (found === undefined) this.find(view, nearField);
    return found === 'asked' ? undefined : found;
  }

  private find(view: CellView, nearField: number): void {
    this.found.set(view, 'asked');
    const triangles = view.near.map(({ geometry }) => ({
      positions: geometry.getAttribute('position').array as Float32Array<ArrayBuffer>,
      indices: geometry.index?.array as Uint32Array<ArrayBuffer>,
    }));
    const options: FindOptions = { nearField, largest: LARGEST * nearField, fewest: FEWEST };
    this.options.builder.objects(triangles, options).then(
      (result) => {
        if (view.group.parent === null) return; // disposed of meanwhile
        const objects = new NearObjects(view, result);
        this.found.set(view, objects);
        view.group.addEventListener('removed', () => {
          if (this.shown === objects) this.showNear(undefined);
          objects.dispose();
        });
      },
      // Without them the near field is drawn as it is; the builder has been disposed of.
      () => undefined,
    );
  }
}
