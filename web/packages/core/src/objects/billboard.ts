/**
 * The billboard that stands for an object (Davis, "Dynamic 2D Imposters", section 3): its bounding
 * box is projected to the screen, and the rectangle around it is put back into space at the box's
 * nearest depth. The same rectangle is the frustum through which the object's picture is taken, so
 * at that moment the billboard covers exactly the pixels that the object would.
 *
 * Which way it faces is Christiansen's choice (section 4.3): `camera-plane` is parallel to the
 * picture, `camera` is square to the line of sight, less stretched at the picture's edge;
 * `cylindrical` turns about an upright axis only, so that tall things keep standing.
 */

import type { Bounds, Vec3 } from '../format.js';
import { add, cross, dot, scale, subtract, transformPoint, unit, type Matrix } from './vectors.js';

export type Turning = 'spherical' | 'cylindrical';
export type Facing = 'camera' | 'camera-plane';

/** Unit vectors, square to each other; `forward` leads away from the eye. */
export interface Basis {
  readonly right: Vec3;
  readonly up: Vec3;
  readonly forward: Vec3;
}

/** The view of one box from one eye. */
export interface Frame {
  readonly eye: Vec3;
  readonly basis: Basis;
  /** Slopes right / forward and up / forward of the rectangle's edges. */
  readonly left: number;
  readonly bottom: number;
  readonly rightmost: number;
  readonly top: number;
  /** Distances along `forward` of the box's nearest and farthest corner. */
  readonly near: number;
  readonly far: number;
}

/** A rectangle in space: its centre, and half its edges. */
export interface Billboard {
  readonly centre: Vec3;
  readonly right: Vec3;
  readonly up: Vec3;
}

/** The eight corners of a box under a matrix. */
export function boxCorners({ min, max }: Bounds, matrix?: Matrix): Vec3[] {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) => {
    const corner: Vec3 = [
      n & 1 ? max[0] : min[0],
      n & 2 ? max[1] : min[1],
      n & 4 ? max[2] : min[2],
    ];
    return matrix === undefined ? corner : transformPoint(matrix, corner);
  });
}

/**
 * Which way a billboard faces.
 *
 * @param toObject from the eye to the middle of the object
 * @param axis unit vector that a cylindrical billboard keeps upright
 */
export function facingBasis(
  turning: Turning,
  facing: Facing,
  camera: Basis,
  toObject: Vec3,
  axis: Vec3 = [0, 1, 0],
): Basis {
  let forward = facing === 'camera' ? (unit(toObject) ?? camera.forward) : camera.forward;
  let above = camera.up;
  if (turning === 'cylindrical') {
    above = axis;
    // Straight from above an upright billboard is a line, whatever it does; it turns with the camera.
    forward =
      unit(subtract(forward, scale(axis, dot(forward, axis)))) ??
      unit(subtract(camera.up, scale(axis, dot(camera.up, axis)))) ??
      camera.forward;
  }
  const right = unit(cross(forward, above)) ?? camera.right;
  return { right, up: cross(right, forward), forward };
}

/** The frame around a box's corners, or undefined if part of it is nearer than `near`. */
export function frameBox(
  corners: readonly Vec3[],
  eye: Vec3,
  basis: Basis,
  near: number,
): Frame | undefined {
  let [left, bottom, rightmost, top] = [Infinity, Infinity, -Infinity, -Infinity];
  let [nearest, farthest] = [Infinity, 0];
  for (const corner of corners) {
    const q = subtract(corner, eye);
    const z = dot(q, basis.forward);
    if (z < near) return undefined;
    const u = dot(q, basis.right) / z;
    const v = dot(q, basis.up) / z;
    left = Math.min(left, u);
    rightmost = Math.max(rightmost, u);
    bottom = Math.min(bottom, v);
    top = Math.max(top, v);
    nearest = Math.min(nearest, z);
    farthest = Math.max(farthest, z);
  }
  return { eye, basis, left, bottom, rightmost, top, near: nearest, far: farthest };
}

/** The frame with `texels` of margin on each side of a picture of `size` texels. */
export function padFrame(frame: Frame, size: number, texels: number): Frame {
  const share = texels / (size - 2 * texels);
  const u = share * (frame.rightmost - frame.left);
  const v = share * (frame.top - frame.bottom);
  return {
    ...frame,
    left: frame.left - u,
    rightmost: frame.rightmost + u,
    bottom: frame.bottom - v,
    top: frame.top + v,
  };
}

/** The frame's rectangle at its nearest depth. */
export function billboard(frame: Frame): Billboard {
  const { eye, basis, near } = frame;
  const middle = add(
    scale(basis.right, (near * (frame.left + frame.rightmost)) / 2),
    scale(basis.up, (near * (frame.bottom + frame.top)) / 2),
  );
  return {
    centre: add(eye, add(middle, scale(basis.forward, near))),
    right: scale(basis.right, (near * (frame.rightmost - frame.left)) / 2),
    up: scale(basis.up, (near * (frame.top - frame.bottom)) / 2),
  };
}

/** How long the frame's longer side is on a screen of `focal` pixels per unit of slope, pixels. */
export function framePixels(frame: Frame, focal: number): number {
  return focal * Math.max(frame.rightmost - frame.left, frame.top - frame.bottom);
}
