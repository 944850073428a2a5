/** A gamepad's sticks and buttons, by the standard mapping. */

/** Sticks rest near the middle, not in it. */
const DEAD = 0.15;

export interface PadState {
  readonly right: number;
  readonly forward: number;
  readonly up: number;
  /** Turning, -1 to 1: left and up are positive. */
  readonly yaw: number;
  readonly pitch: number;
  readonly fast: boolean;
  /** Whether the button that changes between walking and flying (Y, triangle) is down. */
  readonly fly: boolean;
}

type Pad = Pick<Gamepad, 'axes' | 'mapping'> & {
  readonly buttons: readonly { readonly pressed: boolean; readonly value: number }[];
};

/** What the first pad that is used says; undefined if none is. */
export function readPads(pads: readonly (Pad | null)[]): PadState | undefined {
  const pad = pads.find((candidate) => candidate?.mapping === 'standard');
  if (pad === undefined || pad === null) return undefined;
  const stick = (axis: number): number => bend(pad.axes.at(axis) ?? 0);
  const pressed = (button: number): boolean => pad.buttons.at(button)?.pressed ?? false;
  const pulled = (button: number): number => pad.buttons.at(button)?.value ?? 0;
  return {
    right: stick(0),
    forward: -stick(1),
    up: (pressed(0) ? 1 : 0) - (pressed(1) ? 1 : 0),
    yaw: -stick(2),
    pitch: -stick(3),
    fast: pulled(7) > 0.3 || pulled(6) > 0.3 || pressed(10),
    fly: pressed(3),
  };
}

/** Nothing inside the dead zone, then gently up to 1. */
function bend(value: number): number {
  const size = Math.min(1, Math.max(0, (Math.abs(value) - DEAD) / (1 - DEAD)));
  return Math.sign(value) * size * size;
}
