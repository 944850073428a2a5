/**
 * The six faces of a cell's layer cubes (docs/format.md, "Faces").
 *
 * A point p seen from eye e has Z = (p - e) . forward, u = (p - e) . right / Z,
 * v = (p - e) . down / Z and disparity d = 1 / Z.
 */

import type { Vec3 } from './format.js';

export interface Face {
  readonly forward: Vec3;
  readonly right: Vec3;
  readonly down: Vec3;
}

/** The index is the face number of the format. */
export const FACES: readonly Face[] = [
  { forward: [1, 0, 0], right: [0, 0, 1], down: [0, -1, 0] },
  { forward: [-1, 0, 0], right: [0, 0, -1], down: [0, -1, 0] },
  { forward: [0, 1, 0], right: [-1, 0, 0], down: [0, 0, 1] },
  { forward: [0, -1, 0], right: [-1, 0, 0], down: [0, 0, -1] },
  { forward: [0, 0, 1], right: [-1, 0, 0], down: [0, -1, 0] },
  { forward: [0, 0, -1], right: [1, 0, 0], down: [0, -1, 0] },
];
