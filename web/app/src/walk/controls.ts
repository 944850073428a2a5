/** Keyboard, mouse, touch and gamepad, gathered into one intent. */

import { readPads } from './gamepad.js';
import type { Intent } from './walker.js';

const KEYS: Readonly<Record<string, readonly ['right' | 'forward' | 'up', number] | undefined>> = {
  KeyW: ['forward', 1],
  ArrowUp: ['forward', 1],
  KeyS: ['forward', -1],
  ArrowDown: ['forward', -1],
  KeyA: ['right', -1],
  KeyD: ['right', 1],
  KeyE: ['up', 1],
  KeyR: ['up', 1],
  Space: ['up', 1],
  KeyQ: ['up', -1],
  KeyF: ['up', -1],
  KeyC: ['up', -1],
};
const TURNS: Readonly<Record<string, number | undefined>> = { ArrowLeft: 1, ArrowRight: -1 };
/** Radians per pixel of mouse or thumb. */
const LOOK = 0.0026;
const TOUCH_LOOK = 0.006;
/** Radians a second while an arrow key is held. */
const TURN_SPEED = 1.6;
/** The same for a gamepad's stick. */
const PAD_SPEED = 2.4;
/** Pixels from the thumb's first place to full speed. */
const STICK = 56;

/** A thumb that moves the walker: where it came down and where it is, in pixels. */
export interface Stick {
  readonly x: number;
  readonly y: number;
  readonly dx: number;
  readonly dy: number;
}

export class Controls {
  /** The left thumb, for drawing. */
  stick: Stick | undefined;
  onKey: (code: string) => void = () => undefined;
  onWheel: (steps: number) => void = () => undefined;
  private readonly canvas: HTMLCanvasElement;
  private readonly abort = new AbortController();
  private readonly held = new Set<string>();
  private shift = false;
  private yaw = 0;
  private pitch = 0;
  private drag: { id: number; x: number; y: number; travelled: number } | undefined;
  private thumb: number | undefined;
  private padFly = false;

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    const { signal } = this.abort;
    window.addEventListener('keydown', this.onKeyDown, { signal });
    window.addEventListener('keyup', this.onKeyUp, { signal });
    window.addEventListener('blur', this.release, { signal });
    canvas.addEventListener('pointerdown', this.onDown, { signal });
    canvas.addEventListener('pointermove', this.onMove, { signal });
    canvas.addEventListener('pointerup', this.onUp, { signal });
    canvas.addEventListener('pointercancel', this.onUp, { signal });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault(), { signal });
    canvas.addEventListener('wheel', this.onScroll, { signal, passive: false });
  }

  /** Whether the mouse is captured. */
  get locked(): boolean {
    return document.pointerLockElement === this.canvas;
  }

  /** What is wanted now; turns since the last call are used up. */
  read(seconds: number): Intent {
    const axes = { right: 0, forward: 0, up: 0 };
    let turn = 0;
    for (const code of this.held) {
      const move = KEYS[code];
      if (move !== undefined) axes[move[0]] += move[1];
      turn += TURNS[code] ?? 0;
    }
    if (this.stick !== undefined) {
      axes.right += clamp(this.stick.dx / STICK);
      axes.forward -= clamp(this.stick.dy / STICK);
    }
    const pad = readPads(navigator.getGamepads());
    if (pad !== undefined) {
      if (pad.fly && !this.padFly) this.onKey('KeyG');
      this.padFly = pad.fly;
    }
    const intent: Intent = {
      right: clamp(axes.right + (pad?.right ?? 0)),
      forward: clamp(axes.forward + (pad?.forward ?? 0)),
      up: clamp(axes.up + (pad?.up ?? 0)),
      yaw: this.yaw + (turn * TURN_SPEED + (pad?.yaw ?? 0) * PAD_SPEED) * seconds,
      pitch: this.pitch + (pad?.pitch ?? 0) * PAD_SPEED * seconds,
      fast: this.shift || pad?.fast === true,
    };
    this.yaw = 0;
    this.pitch = 0;
    return intent;
  }

  dispose(): void {
    this.abort.abort();
    if (this.locked) document.exitPointerLock();
  }

  private readonly onKeyDown = (event: KeyboardEvent): void => {
    this.shift = event.shiftKey;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target instanceof HTMLInputElement) return;
    // Keys that operate a focused button must reach it.
    if (event.target instanceof HTMLButtonElement && ['Space', 'Enter'].includes(event.code))
      return;
    if (KEYS[event.code] !== undefined || TURNS[event.code] !== undefined) {
      this.held.add(event.code);
      event.preventDefault();
    } else if (!event.repeat) {
      this.onKey(event.key === '?' ? '?' : event.code);
    }
  };

  private readonly onKeyUp = (event: KeyboardEvent): void => {
    this.shift = event.shiftKey;
    this.held.delete(event.code);
  };

  private readonly release = (): void => {
    this.held.clear();
    this.shift = false;
    this.stick = undefined;
    this.thumb = undefined;
    this.drag = undefined;
  };

  private readonly onDown = (event: PointerEvent): void => {
    this.canvas.focus({ preventScroll: true });
    if (event.pointerType === 'mouse') {
      if (event.button === 0 && !this.locked) this.startDrag(event);
      return;
    }
    event.preventDefault();
    const left = event.clientX < this.canvas.clientWidth / 2;
    if (left && this.thumb === undefined) {
      this.canvas.setPointerCapture(event.pointerId);
      this.thumb = event.pointerId;
      this.stick = { x: event.clientX, y: event.clientY, dx: 0, dy: 0 };
    } else if (this.drag === undefined) {
      this.startDrag(event);
    }
  };

  private startDrag(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    this.drag = { id: event.pointerId, x: event.clientX, y: event.clientY, travelled: 0 };
  }

  private readonly onMove = (event: PointerEvent): void => {
    if (event.pointerId === this.thumb && this.stick !== undefined) {
      const { x, y } = this.stick;
      const [dx, dy] = [event.clientX - x, event.clientY - y];
      const shrink = Math.min(1, STICK / Math.max(1e-6, Math.hypot(dx, dy)));
      this.stick = { x, y, dx: dx * shrink, dy: dy * shrink };
    } else if (this.locked) {
      this.look(event.movementX * LOOK, event.movementY * LOOK);
    } else if (this.drag?.id === event.pointerId) {
      const [dx, dy] = [event.clientX - this.drag.x, event.clientY - this.drag.y];
      this.drag.x = event.clientX;
      this.drag.y = event.clientY;
      this.drag.travelled += Math.abs(dx) + Math.abs(dy);
      const scale = event.pointerType === 'mouse' ? LOOK * 1.5 : TOUCH_LOOK;
      this.look(dx * scale, dy * scale);
    }
  };

  private readonly onUp = (event: PointerEvent): void => {
    if (event.pointerId === this.thumb) {
      this.thumb = undefined;
      this.stick = undefined;
    } else if (this.drag?.id === event.pointerId) {
      const click = this.drag.travelled < 4 && event.type === 'pointerup';
      this.drag = undefined;
      if (click && event.pointerType === 'mouse') this.lock();
    }
  };

  private readonly onScroll = (event: WheelEvent): void => {
    event.preventDefault();
    this.onWheel(-Math.sign(event.deltaY));
  };

  private look(right: number, down: number): void {
    this.yaw -= right;
    this.pitch -= down;
  }

  /** Capture the mouse where the browser allows it; dragging works without. */
  private lock(): void {
    try {
      // Older browsers return nothing, newer ones a promise that may be refused.
      const asked = this.canvas.requestPointerLock() as Promise<void> | undefined;
      asked?.catch(() => undefined);
    } catch {
      return;
    }
  }
}

function clamp(value: number): number {
  return Math.max(-1, Math.min(1, value));
}
