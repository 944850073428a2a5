/** One object and the pictures that stand for it. */

import {
  LIMITS,
  Fade,
  billboard,
  boxCorners,
  facingBasis,
  frameBox,
  framePixels,
  judge,
  padFrame,
  slotSize,
  MARGIN,
  type Basis,
  type Billboard,
  type Bounds,
  type Facing,
  type Frame,
  type Freshness,
  type Limits,
  type Picture,
  type Slot,
  type Turning,
  type Vec3,
} from '@farfield/core';
import { Box3, Matrix4, Sphere, Vector3, type Frustum, type Object3D } from 'three';
import type { Instance } from './billboards.js';
import { objectBounds, objectCost } from './bounds.js';
import { rigidPose } from './picture-taker.js';

export interface ImpostorOptions {
  /** `cylindrical` for what stands upright. Default `spherical`. */
  readonly turning?: Turning;
  /** Default `camera`. */
  readonly facing?: Facing;
  /** Upright axis of a cylindrical billboard, in the object's space. Default +y. */
  readonly axis?: Vec3;
  /** Seconds a picture may be old, for what is animated or lit anew. Default: for ever. */
  readonly age?: number;
  /** The most that the view may turn, radians, and be moved, pixels. Default 0.1 and 1. */
  readonly angle?: number;
  readonly pixels?: number;
}

/** A picture in a slot. */
interface Shot extends Picture {
  readonly slot: Slot;
  /** In the object's space. */
  readonly board: Billboard;
}

/** How an object is seen in one frame. */
export interface Sight {
  readonly frame: Frame | undefined;
  readonly pixels: number;
  readonly distance: number;
}

/** The camera, in world space. */
export interface Eye {
  readonly position: Vector3;
  readonly basis: Basis;
  readonly frustum: Frustum;
  /** Pixels per unit of slope. */
  readonly focal: number;
  readonly near: number;
}

const toVec3 = ({ x, y, z }: Vector3): Vec3 => [x, y, z];

export class ObjectImpostor {
  readonly object: Object3D;
  readonly limits: Limits;
  readonly pose = new Matrix4();
  readonly fade = new Fade();
  /** Frames since its picture stopped being good enough. */
  waited = 0;
  /** What a picture costs, see `pictureCost`. */
  cost = 0;
  sight: Sight | undefined;
  shot: Shot | undefined;
  private old: Shot | undefined;
  private box: Bounds | undefined;
  private readonly options: ImpostorOptions;
  private readonly give: (slot: Slot) => void;
  private readonly inverse = new Matrix4();
  private readonly sphere = new Sphere();

  /** `give` takes slots that are no longer needed. */
  constructor(object: Object3D, options: ImpostorOptions, give: (slot: Slot) => void) {
    this.object = object;
    this.options = options;
    this.give = give;
    this.limits = {
      angle: options.angle ?? LIMITS.angle,
      pixels: options.pixels ?? LIMITS.pixels,
      age: options.age ?? LIMITS.age,
      hard: LIMITS.hard,
    };
  }

  /** Look at the object; false if it cannot be seen. */
  look(eye: Eye): boolean {
    rigidPose(this.object, this.pose);
    if (this.box === undefined) this.measure();
    const { box } = this;
    if (box === undefined) return false;
    const bounds = new Box3(new Vector3(...box.min), new Vector3(...box.max));
    bounds.getBoundingSphere(this.sphere);
    this.sphere.applyMatrix4(this.pose);
    if (!eye.frustum.intersectsSphere(this.sphere)) return false;
    this.inverse.copy(this.pose).invert();
    const own = this.toOwn(eye.position);
    const turn = (v: Vec3): Vec3 => toVec3(new Vector3(...v).transformDirection(this.inverse));
    const camera: Basis = {
      right: turn(eye.basis.right),
      up: turn(eye.basis.up),
      forward: turn(eye.basis.forward),
    };
    const middle = bounds.getCenter(new Vector3());
    const towards = toVec3(middle.sub(new Vector3(...own)));
    const { turning = 'spherical', facing = 'camera', axis } = this.options;
    const basis = facingBasis(turning, facing, camera, towards, axis);
    const frame = frameBox(boxCorners(box), own, basis, 1.5 * eye.near);
    this.sight = {
      frame,
      pixels: frame === undefined ? Infinity : framePixels(frame, eye.focal),
      distance: this.sphere.center.distanceTo(eye.position),
    };
    return true;
  }

  /** Whether the last picture still does; call after `look`. */
  judge(eye: Eye, now: number): Freshness {
    const { box, shot, sight } = this;
    if (box === undefined || shot === undefined || sight === undefined) return 'expired';
    const look = { eye: this.toOwn(eye.position), focal: eye.focal, pixels: sight.pixels, now };
    return judge(box, shot, look, this.limits);
  }

  /** The slot that a new picture needs; undefined if the object is too large or too near for one. */
  get wantedSlot(): number | undefined {
    return this.sight === undefined ? undefined : slotSize(this.sight.pixels);
  }

  /** Measure the box anew, as what is animated needs. */
  measure(): void {
    this.object.updateWorldMatrix(true, true);
    this.box = objectBounds(this.object);
    this.cost = objectCost(this.object);
  }

  /** A picture is about to be taken into `slot`; returns how. */
  take(slot: Slot, now: number): Frame | undefined {
    const frame = this.sight?.frame;
    if (frame === undefined) return undefined;
    const padded = padFrame(frame, slot.size, MARGIN);
    if (this.old !== undefined) this.give(this.old.slot);
    this.old = this.shot;
    const { size } = slot;
    this.shot = { frame: padded, size, taken: now, slot, board: billboard(padded) };
    this.waited = 0;
    this.fade.toPicture(now);
    return padded;
  }

  /** Show the object itself, and give the pictures' slots back once they have faded. */
  retreat(now: number): void {
    this.fade.toObject(now);
  }

  /** Let go of all pictures at once; `lost`: their slots are gone. */
  drop(now: number, lost = false): void {
    for (const shot of [this.old, this.shot]) if (shot !== undefined && !lost) this.give(shot.slot);
    this.old = this.shot = undefined;
    this.fade.toObject(now);
  }

  /** Show what the fade says: adds billboards to `instances`. */
  show(instances: Instance[], eye: Eye, now: number, seconds: number): void {
    const fade = Math.min(seconds, this.limits.age);
    const weights = this.fade.weights(now, fade);
    if (this.old !== undefined && this.fade.done(now, fade)) {
      this.give(this.old.slot);
      this.old = undefined;
    }
    this.object.visible = weights.object || this.shot === undefined;
    this.push(instances, this.old, weights.old, eye, 0);
    this.push(instances, this.shot, weights.picture, eye, 1);
  }

  private push(
    instances: Instance[],
    shot: Shot | undefined,
    weight: number,
    eye: Eye,
    order: number,
  ): void {
    if (shot === undefined || weight <= 0) return;
    const place = new Vector3(...shot.board.centre).applyMatrix4(this.pose);
    rotation.copy(this.pose).setPosition(0, 0, 0);
    instances.push({
      centre: place,
      right: new Vector3(...shot.board.right).applyMatrix4(rotation),
      up: new Vector3(...shot.board.up).applyMatrix4(rotation),
      slot: shot.slot,
      weight,
      // By the object's middle: billboards of one object must not part.
      distance: this.sight?.distance ?? place.distanceTo(eye.position),
      order,
    });
  }

  private toOwn(position: Vector3): Vec3 {
    return toVec3(position.clone().applyMatrix4(this.inverse));
  }
}

const rotation = new Matrix4();
