/** A walker: how intents become motion inside a corridor. No engine, no page. */

import { clampInto, slide, type CellIndex, type Vec3 } from '@farfield/core';
import type { Pose } from './address.js';

/** What the walker wants, each from -1 to 1; turns are in radians since the last step. */
export interface Intent {
  readonly right: number;
  readonly forward: number;
  readonly up: number;
  readonly yaw: number;
  readonly pitch: number;
  readonly fast: boolean;
}

export const STILL: Intent = { right: 0, forward: 0, up: 0, yaw: 0, pitch: 0, fast: false };

const STEEPEST = Math.PI / 2 - 0.01;
const FAST = 4;
/** Seconds in which speed follows the intent. */
const INERTIA = 0.1;
/** Seconds in which height follows the ground from cell to cell. */
const FOLLOW = 0.25;

/**
 * Walking speed for cells whose shortest side across the ground is `size`, metres a second.
 * A person's pace where cells are rooms or streets, a bit more where they are large, and in
 * proportion where the unit can't be the metre: cells of over a hundred are centimetres or
 * millimetres, cells of a few decimetres are models on a table.
 */
export function walkingSpeed(size: number): number {
  if (size < 4) return 0.35 * size;
  if (size > 100) return 0.35 * size;
  return 1.4 * Math.sqrt(size / 4);
}

export class Walker {
  eye: Vec3 = [0, 0, 0];
  yaw = 0;
  pitch = 0;
  /** Forward follows the view up and down. */
  flying = false;
  /** A factor on the walking speed. */
  pace = 1;
  /** Without inertia. */
  direct = false;
  /** Whether a wall stopped the last step. */
  blocked = false;
  private velocity: [number, number, number] = [0, 0, 0];
  /** Height kept above the floor of cells while walking. */
  private height: number | undefined;

  get pose(): Pose {
    return { eye: this.eye, yaw: this.yaw, pitch: this.pitch };
  }

  /** Stand somewhere else at once. */
  place({ eye, yaw, pitch }: Pose): void {
    this.eye = eye;
    this.yaw = yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, pitch));
    this.velocity = [0, 0, 0];
    this.height = undefined;
  }

  /** Stand at the nearest place inside the corridor. */
  enter(index: CellIndex): void {
    if (index.at(this.eye) === undefined) this.eye = clampInto(index, this.eye);
  }

  /** Move for `seconds`; `brake` from 0 to 1 is asked for every new place. */
  step(seconds: number, intent: Intent, index: CellIndex, brake: (eye: Vec3) => number): void {
    this.yaw += intent.yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch + intent.pitch));
    const wish = this.wish(intent, index);
    const blend = this.direct ? 1 : 1 - Math.exp(-seconds / INERTIA);
    for (const axis of [0, 1, 2]) {
      this.velocity[axis] += (wish[axis] - this.velocity[axis]) * blend;
    }
    this.blocked = false;
    if (Math.hypot(...this.velocity) < 1e-4 * Math.min(...index.grid.size)) {
      this.velocity = [0, 0, 0];
      this.followGround(seconds, index, intent);
      return;
    }
    const [x, y, z] = this.eye;
    const [vx, vy, vz] = this.velocity.map((v) => v * seconds);
    const free = brake([x + vx, y + vy, z + vz]);
    const target: Vec3 = [x + free * vx, y + free * vy, z + free * vz];
    const moved = slide(index, this.eye, target);
    this.eye = moved.eye;
    this.blocked = moved.blocked;
    this.followGround(seconds, index, intent);
  }

  private wish(intent: Intent, { grid }: CellIndex): Vec3 {
    const pace = walkingSpeed(Math.min(grid.size[0], grid.size[2]));
    const speed = pace * this.pace * (intent.fast ? FAST : 1);
    const [sin, cos] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const level = this.flying ? Math.cos(this.pitch) : 1;
    const rise = this.flying ? Math.sin(this.pitch) : 0;
    const wish = [
      intent.right * cos - intent.forward * level * sin,
      intent.forward * rise + intent.up,
      -intent.right * sin - intent.forward * level * cos,
    ];
    const length = Math.max(1, Math.hypot(...wish));
    const [wx, wy, wz] = wish.map((w) => (speed * w) / length);
    // Climbing is slower where cells are flat.
    return [wx, wy * Math.min(1, (2 * grid.size[1]) / grid.size[0]), wz];
  }

  /** Keep the height above the floor of the cells, which may follow the ground. */
  private followGround(seconds: number, index: CellIndex, intent: Intent): void {
    const cell = index.at(this.eye);
    if (cell === undefined) return;
    const above = this.eye[1] - cell.low[1];
    if (
      this.flying ||
      intent.up !== 0 ||
      this.height === undefined ||
      index.column(cell.index[0], cell.index[2]).length > 1
    ) {
      this.height = above;
      return;
    }
    const blend = this.direct ? 1 : 1 - Math.exp(-seconds / FOLLOW);
    const y = this.eye[1] + (this.height - above) * blend;
    const margin = 0.02 * index.grid.size[1];
    this.eye = [
      this.eye[0],
      Math.min(Math.max(y, cell.low[1] + margin), cell.high[1] - margin),
      this.eye[2],
    ];
  }
}
