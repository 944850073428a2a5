/**
 * The fade between an object and its pictures, by time. A picture is laid over what it replaces:
 * first it gains weight over the old one, then the old one loses its weight below it, so the sum
 * never lets through what lies behind both.
 */

export interface Weights {
  /** Whether the object itself is drawn. */
  readonly object: boolean;
  /** Weight of the picture before the last one, drawn first. */
  readonly old: number;
  /** Weight of the last picture. */
  readonly picture: number;
}

type Shown = 'object' | 'picture';

export class Fade {
  private shown: Shown = 'object';
  private before: Shown | undefined;
  private since = -Infinity;

  /** A new picture has been taken. */
  toPicture(now: number): void {
    this.before = this.shown;
    this.shown = 'picture';
    this.since = now;
  }

  /** The picture will do no more. */
  toObject(now: number): void {
    if (this.shown === 'object') return;
    this.before = 'picture';
    this.shown = 'object';
    this.since = now;
  }

  /** Whether the picture before the last one is no longer needed. */
  done(now: number, seconds: number): boolean {
    return now - this.since >= seconds;
  }

  /** What is drawn now, if a fade takes `seconds`. */
  weights(now: number, seconds: number): Weights {
    const t = seconds > 0 ? Math.min(1, Math.max(0, (now - this.since) / seconds)) : 1;
    const { shown, before } = this;
    if (shown === 'object') {
      return { object: true, old: 0, picture: before === 'picture' ? 1 - t : 0 };
    }
    const rising = Math.min(1, 2 * t);
    const falling = Math.min(1, 2 - 2 * t);
    if (before === 'picture') return { object: false, old: t < 1 ? falling : 0, picture: rising };
    return { object: t < 0.5, old: 0, picture: rising };
  }
}
