/**
 * When an impostor's picture is no longer good enough (Davis, "Dynamic 2D Imposters" section 8 and
 * "Taking Imposters Further"; Christiansen, section 4).
 *
 * Everything is measured in the object's own space: the eye moves about the object, whichever of
 * the two it is that moves or turns. The near and the far point of the box are tested, since the
 * centre says too little: close by, the near point turns most; and what lies deep behind the
 * billboard is what parallax moves most.
 */

import type { Bounds, Vec3 } from '../format.js';
import { boxCorners, type Frame } from './billboard.js';
import { MARGIN, slotSize } from './slot-size.js';
import { add, angleBetween, distance, dot, scale, subtract } from './vectors.js';

/** What is known of a picture. */
export interface Picture {
  /** How it was taken; the eye, the basis and the depth are in the object's space. */
  readonly frame: Frame;
  /** Edge of its slot, texels. */
  readonly size: number;
  /** When it was taken, seconds. */
  readonly taken: number;
}

export interface Limits {
  /** View angle in the object's space, radians. */
  readonly angle: number;
  /** Parallax on the screen, pixels. */
  readonly pixels: number;
  /** Age, seconds; Infinity for what neither moves in itself nor is lit anew. */
  readonly age: number;
  /** How many times the limits a picture may reach before the object itself is drawn instead. */
  readonly hard: number;
}

export const LIMITS: Limits = { angle: 0.1, pixels: 1, age: Infinity, hard: 3 };

export interface Look {
  /** The eye now, in the object's space. */
  readonly eye: Vec3;
  /** Pixels per unit of slope. */
  readonly focal: number;
  /** Pixels that the object covers now, along its longer side. */
  readonly pixels: number;
  /** Seconds. */
  readonly now: number;
}

/** `stale`: to be taken anew when there is time; `expired`: not to be shown. */
export type Freshness = 'fresh' | 'stale' | 'expired';

/** The point of a box nearest to `eye`, and its corner farthest from it. */
export function nearAndFar({ min, max }: Bounds, eye: Vec3): [near: Vec3, far: Vec3] {
  const pick = (choose: (axis: 0 | 1 | 2) => number): Vec3 => [choose(0), choose(1), choose(2)];
  return [
    pick((axis) => Math.min(Math.max(eye[axis], min[axis]), max[axis])),
    pick((axis) =>
      Math.abs(min[axis] - eye[axis]) > Math.abs(max[axis] - eye[axis]) ? min[axis] : max[axis],
    ),
  ];
}

/**
 * By how much the view of a box has turned between two eyes, radians: the larger of the angles at
 * its near and its far point, each as seen from the eye now. An eye inside the box sees all of it turn.
 */
export function viewAngle(box: Bounds, before: Vec3, now: Vec3): number {
  const [near, far] = nearAndFar(box, now);
  if (distance(near, now) < 1e-9) return Math.PI;
  const turned = (point: Vec3): number =>
    angleBetween(subtract(before, point), subtract(now, point));
  return Math.max(turned(near), turned(far));
}

/**
 * By how much the billboard shows a corner of the box elsewhere than it is, radians: the most over
 * the box's corners. Where the picture was taken it is 0, on the billboard itself always.
 */
export function parallax(box: Bounds, frame: Frame, eye: Vec3): number {
  let most = 0;
  for (const corner of boxCorners(box)) {
    const ray = subtract(corner, frame.eye);
    const along = dot(ray, frame.basis.forward);
    const shown = add(frame.eye, scale(ray, frame.near / along));
    most = Math.max(most, angleBetween(subtract(shown, eye), subtract(corner, eye)));
  }
  return most;
}

/** Whether a picture will still do. */
export function judge(box: Bounds, picture: Picture, look: Look, limits: Limits): Freshness {
  const { frame, size, taken } = picture;
  const ratio = Math.max(
    viewAngle(box, frame.eye, look.eye) / limits.angle,
    (look.focal * parallax(box, frame, look.eye)) / limits.pixels,
    (look.now - taken) / limits.age,
  );
  // A texel may never be bigger than a pixel, except for the margin that rounding leaves.
  if (ratio > limits.hard || look.pixels > 1.05 * (size - 2 * MARGIN)) return 'expired';
  if (ratio > 1) return 'stale';
  const wanted = slotSize(look.pixels, 1) ?? Infinity;
  // Sizes overlap, or an object at the limit between two would be drawn anew without end.
  const roomy = slotSize(look.pixels, 1.5) ?? Infinity;
  return wanted > size || roomy < size ? 'stale' : 'fresh';
}
