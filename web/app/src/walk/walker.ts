/** A walker: how intents become motion inside a corridor. No engine, no page. */

import { clampInto, slide, type CellIndex, type Solid, type Vec3 } from '@farfield/core';
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

/** What a walker moves in. */
export interface World {
  readonly index: CellIndex;
  /** Asked for every new place: how freely it may be gone to, 0 to 1. */
  readonly brake: (eye: Vec3) => number;
  /** What to stand on and bump into; without it only the corridor holds the walker. */
  readonly solid?: Solid | undefined;
  /** Metres a second at most. */
  readonly topSpeed?: number;
}

export const STILL: Intent = { right: 0, forward: 0, up: 0, yaw: 0, pitch: 0, fast: false };

/** A person: eye above the ground, half width, the highest step, metres. */
export const EYE = 1.7;
const RADIUS = 0.3;
const STEP = 0.55;
const STEEPEST = Math.PI / 2 - 0.01;
const FAST = 4;
/** Seconds in which speed follows the intent. */
const INERTIA = 0.1;
/** Seconds in which height follows the ground. */
const FOLLOW = 0.12;
/** The corridor's edge slows the walker from here on, in cells. */
const SOFT = 0.06;

/**
 * Walking speed for cells whose shortest side across the ground is `size`, metres a second.
 * A person's pace where cells are rooms or streets, a bit more where they are large, and in
 * proportion where the unit can't be the metre: cells of over a hundred are centimetres or
 * millimetres, cells of a few decimetres are models on a table.
 */
export function walkingSpeed(size: number): number {
  if (size < 4 || size > 100) return 0.35 * size;
  return 1.4 * Math.sqrt(size / 4);
}

/** How long a metre is where cells are `size` across. */
export function metre(size: number): number {
  return size < 4 || size > 100 ? 0.25 * size : 1;
}

export class Walker {
  eye: Vec3 = [0, 0, 0];
  yaw = 0;
  pitch = 0;
  /** A factor on the walking speed. */
  pace = 1;
  /** Without inertia. */
  direct = false;
  /** Whether the corridor's edge stopped or slowed the last step. */
  blocked = false;
  private fly = false;
  private velocity: [number, number, number] = [0, 0, 0];
  /** Height kept above the ground; 'person' is eye level, undefined is as high as it happens to be. */
  private height: number | 'person' | undefined;
  /** Whether that height is above real ground, or above the floor of the cells. */
  private aboveGround = false;

  get pose(): Pose {
    return { eye: this.eye, yaw: this.yaw, pitch: this.pitch };
  }

  /** Forward follows the view up and down, through walls. Whoever lands stands on the ground. */
  get flying(): boolean {
    return this.fly;
  }

  set flying(flying: boolean) {
    if (this.fly && !flying) this.height = 'person';
    this.fly = flying;
  }

  /** Stand somewhere else at once, exactly. */
  place({ eye, yaw, pitch }: Pose): void {
    this.eye = eye;
    this.yaw = yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, pitch));
    this.velocity = [0, 0, 0];
    this.height = undefined;
  }

  /** Come down to eye level as soon as there is ground. */
  land(): void {
    this.height = 'person';
  }

  /** Stand at the nearest place inside the corridor. */
  enter(index: CellIndex): void {
    if (index.at(this.eye) === undefined) this.eye = clampInto(index, this.eye);
  }

  /** Move for `seconds`. */
  step(seconds: number, intent: Intent, world: World): void {
    const { index } = world;
    this.yaw += intent.yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch + intent.pitch));
    const wish = this.wish(intent, world);
    const blend = this.direct ? 1 : 1 - Math.exp(-seconds / INERTIA);
    for (const axis of [0, 1, 2]) {
      this.velocity[axis] += (wish[axis] - this.velocity[axis]) * blend;
    }
    this.blocked = false;
    if (Math.hypot(...this.velocity) < 1e-4 * Math.min(...index.grid.size)) {
      this.velocity = [0, 0, 0];
    } else {
      this.move(seconds, world);
    }
    this.followGround(seconds, intent, world);
  }

  private move(seconds: number, world: World): void {
    const { index, brake, solid } = world;
    const [x, y, z] = this.eye;
    const [vx, vy, vz] = this.soften(index).map((v) => v * seconds);
    const free = brake([x + vx, y + vy, z + vz]);
    const unit = metre(Math.min(index.grid.size[0], index.grid.size[2]));
    const walled = solid !== undefined && !this.fly;
    // A body that moves less than its own half width at a time cannot pass through a wall.
    const longest = free * Math.hypot(vx, vz);
    const parts = walled
      ? Math.min(64, Math.max(1, Math.ceil(longest / (0.6 * RADIUS * unit))))
      : 1;
    for (let n = 0; n < parts; n++) {
      const [ex, ey, ez] = this.eye;
      const share = free / parts;
      let target: Vec3 = [ex + share * vx, ey + share * vy, ez + share * vz];
      if (walled) {
        const feet = target[1] - this.above(solid, target, unit);
        const low = feet + STEP * unit;
        const high = Math.max(low, target[1]) + 0.15 * unit;
        const [px, pz] = solid.push(target[0], target[2], low, high, RADIUS * unit);
        target = [px, target[1], pz];
      }
      const moved = slide(index, this.eye, target);
      this.eye = moved.eye;
      this.blocked ||= moved.blocked;
    }
  }

  /** Height of the eye above what it stands on, where that is known. */
  private above(solid: Solid, [x, y, z]: Vec3, unit: number): number {
    if (typeof this.height === 'number') return this.height;
    const ground = footing(solid, x, y, z, unit);
    return ground === undefined ? EYE * unit : y - ground;
  }

  /** The velocity, slower the nearer the corridor's edge ahead is. */
  private soften(index: CellIndex): [number, number, number] {
    const velocity: [number, number, number] = [...this.velocity];
    for (const axis of [0, 2] as const) {
      if (velocity[axis] === 0) continue;
      const reach = SOFT * index.grid.size[axis];
      const probe: [number, number, number] = [...this.eye];
      probe[axis] += Math.sign(velocity[axis]) * reach;
      const free = Math.abs(slide(index, this.eye, probe).eye[axis] - this.eye[axis]);
      if (free > 0.999 * reach) continue;
      velocity[axis] *= Math.max(0.12, free / reach);
      this.blocked = true;
    }
    return velocity;
  }

  private wish(intent: Intent, { index: { grid }, topSpeed = Infinity }: World): Vec3 {
    const pace = walkingSpeed(Math.min(grid.size[0], grid.size[2]));
    const speed = Math.min(topSpeed, pace * this.pace * (intent.fast ? FAST : 1));
    const [sin, cos] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const level = this.fly ? Math.cos(this.pitch) : 1;
    const rise = this.fly ? Math.sin(this.pitch) : 0;
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

  /** Keep the height above the ground, or above the floor of the cells where no ground is known. */
  private followGround(seconds: number, intent: Intent, { index, solid }: World): void {
    const cell = index.at(this.eye);
    if (cell === undefined) return;
    const [x, y, z] = this.eye;
    const unit = metre(Math.min(index.grid.size[0], index.grid.size[2]));
    const known = solid && footing(solid, x, y, z, unit);
    const stacked = index.column(cell.index[0], cell.index[2]).length > 1;
    // Without ground, cells that climb are followed; a stack of cells says nothing.
    const ground = known ?? (solid !== undefined || stacked ? undefined : cell.low[1]);
    if (this.height === 'person') {
      if (known === undefined) return;
      this.height = EYE * unit;
      this.aboveGround = true;
    }
    // Ground that has just come to be known is another thing to stand above, not a drop.
    if (ground !== undefined && (known !== undefined) !== this.aboveGround) {
      this.aboveGround = known !== undefined;
      this.height = undefined;
    }
    if (this.fly || intent.up !== 0 || this.height === undefined || ground === undefined) {
      if (this.fly || intent.up !== 0) this.height = undefined;
      if (this.height === undefined && ground !== undefined) this.height = y - ground;
      return;
    }
    const blend = this.direct ? 1 : 1 - Math.exp(-seconds / FOLLOW);
    const wanted = y + (this.height + ground - y) * blend;
    const margin = 0.02 * index.grid.size[1];
    const [low, high] = stacked
      ? [-Infinity, Infinity]
      : [cell.low[1] + margin, cell.high[1] - margin];
    this.eye = slide(index, this.eye, [x, Math.min(Math.max(wanted, low), high), z]).eye;
  }
}

/** The ground under a walker's feet: what is highest under a few points, below a step's height. */
function footing(solid: Solid, x: number, y: number, z: number, unit: number): number | undefined {
  const r = 0.5 * RADIUS * unit;
  const top = y - (EYE - STEP) * unit;
  let best: number | undefined;
  for (const [dx, dz] of [
    [0, 0],
    [r, 0],
    [-r, 0],
    [0, r],
    [0, -r],
  ]) {
    const ground = solid.ground(x + dx, z + dz, top);
    if (ground !== undefined && (best === undefined || ground > best)) best = ground;
  }
  return best;
}
