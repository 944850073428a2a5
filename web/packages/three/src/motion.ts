/** Where the camera is in the walk's own coordinates, where it looks and how fast it moves. */

import type { Motion, Vec3 } from '@farfield/core';
import { Matrix4, Vector3, type Camera, type Object3D } from 'three';

/** Seconds over which speed is averaged. */
const SMOOTHING = 0.25;

export class MotionTracker {
  private last: { eye: Vector3; time: number } | undefined;
  private readonly velocity = new Vector3();

  /** Measure; matrices must be up to date. `now` is in milliseconds. */
  update(camera: Camera, group: Object3D, now: number = performance.now()): Motion {
    const local = new Matrix4().copy(group.matrixWorld).invert().multiply(camera.matrixWorld);
    const eye = new Vector3().setFromMatrixPosition(local);
    const view = new Vector3().setFromMatrixColumn(local, 2).negate().normalize();
    if (this.last !== undefined && now > this.last.time) {
      const seconds = (now - this.last.time) / 1000;
      const current = eye.clone().sub(this.last.eye).divideScalar(seconds);
      this.velocity.lerp(current, 1 - Math.exp(-seconds / SMOOTHING));
    }
    this.last = { eye, time: now };
    const plain = (v: Vector3): Vec3 => [v.x, v.y, v.z];
    return { eye: plain(eye), velocity: plain(this.velocity), view: plain(view) };
  }
}
