/**
 * Dynamically generated impostors for the objects of a scene (Christiansen; Davis): every object
 * given to `add` is drawn as a picture of itself for as long as that is good enough.
 */

import { PictureBudget, chooseNext, type Slot, type Vec3, type Waiting } from '@farfield/core';
import {
  Frustum,
  Group,
  Matrix4,
  Vector2,
  Vector3,
  type Camera,
  type Object3D,
  type WebGLRenderer,
} from 'three';
import { AtlasTarget } from './atlas-target.js';
import { Billboards, type Instance } from './billboards.js';
import { ObjectImpostor, type Eye, type ImpostorOptions } from './object-impostor.js';
import { PictureTaker, type Order } from './picture-taker.js';

export interface ObjectImpostorsOptions {
  readonly renderer: WebGLRenderer;
  /** Edge of the atlas, texels. Default 2048. */
  readonly atlas?: number;
  /** Pictures taken in one frame at most. Default 8. */
  readonly perFrame?: number;
  /** Milliseconds of a frame that pictures may take of the main thread. Default 4. */
  readonly milliseconds?: number;
  /** Seconds that a fade takes. Default 0.25. */
  readonly fade?: number;
}

export interface ImpostorStats {
  /** Objects that may be drawn as pictures. */
  readonly objects: number;
  /** How many of them are drawn as pictures in this frame. */
  readonly pictures: number;
  /** Pictures taken in this frame, and in all. */
  readonly taken: number;
  readonly takenInAll: number;
  /** Objects that wait for a new picture. */
  readonly waiting: number;
  /** Share of the atlas in use. */
  readonly fill: number;
}

export class ObjectImpostors {
  /** Holds the billboards; add it to your scene. */
  readonly group = new Group();
  private readonly renderer: WebGLRenderer;
  private readonly perFrame: number;
  private readonly fade: number;
  private readonly budget: PictureBudget;
  private readonly atlas: AtlasTarget;
  private readonly taker: PictureTaker;
  private readonly billboards: Billboards;
  private readonly items = new Map<Object3D, ObjectImpostor>();
  private readonly counts = { pictures: 0, taken: 0, takenInAll: 0, waiting: 0 };

  constructor(options: ObjectImpostorsOptions) {
    this.renderer = options.renderer;
    const largest = options.renderer.capabilities.maxTextureSize;
    const size = Math.min(options.atlas ?? 2048, largest);
    this.perFrame = options.perFrame ?? 8;
    this.fade = options.fade ?? 0.25;
    this.budget = new PictureBudget(options.milliseconds ?? 4);
    this.atlas = new AtlasTarget(size);
    this.taker = new PictureTaker(options.renderer, this.atlas);
    this.billboards = new Billboards(this.atlas.target.texture, size);
    this.group.name = 'farfield impostors';
    this.group.add(this.billboards.mesh);
    this.renderer.domElement.addEventListener('webglcontextlost', this.onContextLost);
  }

  /**
   * Draw an object as impostors from now on. It must be in the scene, and its `visible` is ours
   * until it is removed. Hidden objects cast no shadows.
   */
  add(object: Object3D, options: ImpostorOptions = {}): void {
    this.remove(object);
    const give = (slot: Slot): void => this.atlas.slots.give(slot);
    this.items.set(object, new ObjectImpostor(object, options, give));
  }

  /** Draw an object as itself again. */
  remove(object: Object3D): void {
    const item = this.items.get(object);
    if (item === undefined) return;
    item.drop(0);
    object.visible = true;
    this.items.delete(object);
  }

  /** Call once a frame before drawing, when cameras and objects have moved. `now` is in seconds. */
  update(camera: Camera, now = performance.now() / 1000): void {
    const eye = this.eye(camera);
    const seen: ObjectImpostor[] = [];
    const waiting: (Waiting & { item: ObjectImpostor })[] = [];
    for (const item of this.items.values()) {
      item.object.updateWorldMatrix(true, false);
      if (!item.look(eye)) continue;
      seen.push(item);
      const state = item.judge(eye, now);
      if (state === 'expired') item.retreat(now);
      if (state === 'fresh' || item.wantedSlot === undefined) {
        item.waited = 0;
        continue;
      }
      item.waited++;
      const distance = item.sight?.distance ?? Infinity;
      const { waited, cost } = item;
      waiting.push({ item, distance, waited, expired: state === 'expired', cost });
    }
    const chosen = chooseNext(waiting, this.perFrame, this.budget.allowance(waiting));
    const orders = chosen.flatMap(({ item }) => this.order(item, seen, now));
    this.take(orders);
    const instances: Instance[] = [];
    for (const item of seen) item.show(instances, eye, now, this.fade);
    this.counts.pictures = seen.filter(({ object }) => !object.visible).length;
    this.counts.taken = orders.length;
    this.counts.takenInAll += orders.length;
    this.counts.waiting = waiting.length - orders.length;
    this.billboards.write(instances);
  }

  get stats(): ImpostorStats {
    return { ...this.counts, objects: this.items.size, fill: this.atlas.slots.fill };
  }

  dispose(): void {
    this.renderer.domElement.removeEventListener('webglcontextlost', this.onContextLost);
    for (const object of [...this.items.keys()]) this.remove(object);
    this.billboards.dispose();
    this.atlas.dispose();
    this.group.removeFromParent();
  }

  /** Pixels per unit of slope. */
  focal(camera: Camera): number {
    const { height } = this.renderer.getDrawingBufferSize(new Vector2());
    return (camera.projectionMatrix.elements[5] * height) / 2;
  }

  private take(orders: readonly Order[]): void {
    const start = performance.now();
    this.taker.take(orders, rootOf(this.group));
    const cost = orders.reduce((sum, order) => sum + order.cost, 0);
    this.budget.spent(cost, performance.now() - start);
  }

  /** Make room for an item's picture and say how it is taken. */
  private order(item: ObjectImpostor, seen: readonly ObjectImpostor[], now: number): Order[] {
    const size = item.wantedSlot;
    if (size === undefined) return [];
    const slot = this.atlas.slots.take(size) ?? this.makeRoom(size, seen, now);
    if (slot === undefined) return [];
    // What moves in itself has another box every time.
    if (item.limits.age < Infinity) item.measure();
    const frame = item.take(slot, now);
    if (frame === undefined) {
      this.atlas.slots.give(slot);
      return [];
    }
    item.object.visible = true;
    return [{ object: item.object, frame, pose: item.pose, slot, cost: item.cost }];
  }

  /** Drop pictures that are out of sight until a slot is free. */
  private makeRoom(size: number, seen: readonly ObjectImpostor[], now: number): Slot | undefined {
    const visible = new Set(seen);
    for (const item of this.items.values()) {
      if (visible.has(item) || item.shot === undefined) continue;
      item.drop(now);
      item.object.visible = true;
      const slot = this.atlas.slots.take(size);
      if (slot !== undefined) return slot;
    }
    return undefined;
  }

  /** Every object is drawn as itself until it has a new picture. */
  private readonly onContextLost = (): void => {
    this.atlas.forget();
    for (const item of this.items.values()) {
      item.drop(-Infinity, true);
      item.object.visible = true;
    }
    this.billboards.write([]);
  };

  private eye(camera: Camera): Eye {
    camera.updateWorldMatrix(true, false);
    const { elements } = camera.matrixWorld;
    const axis = (column: number, sign: number): Vec3 => {
      const v = new Vector3()
        .fromArray(elements, 4 * column)
        .normalize()
        .multiplyScalar(sign);
      return [v.x, v.y, v.z];
    };
    const projection = camera.projectionMatrix.elements;
    const view = new Matrix4().multiplyMatrices(
      camera.projectionMatrix,
      camera.matrixWorld.clone().invert(),
    );
    return {
      position: new Vector3().setFromMatrixPosition(camera.matrixWorld),
      basis: { right: axis(0, 1), up: axis(1, 1), forward: axis(2, -1) },
      frustum: new Frustum().setFromProjectionMatrix(view),
      focal: this.focal(camera),
      near: projection[14] / (projection[10] - 1),
    };
  }
}

function rootOf(object: Object3D): Object3D {
  let root = object;
  while (root.parent !== null) root = root.parent;
  return root;
}
