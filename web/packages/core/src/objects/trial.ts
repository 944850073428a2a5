/**
 * Whether impostors pay, found out by trying: frames are timed with and without them by turns, and
 * the faster way is kept until the next trial. Medians, because single frames wait for other things.
 */

export interface TrialOptions {
  /** Frames of each measurement. Default 40. */
  readonly frames?: number;
  /** Frames at the beginning of each that are not counted. Default 15. */
  readonly warmUp?: number;
  /** Seconds between two trials. Default 30. */
  readonly every?: number;
  /** With must take no more than this share of without. Default 0.95. */
  readonly gain?: number;
  /** A frame this short needs no help, seconds. Default 1/55. */
  readonly enough?: number;
}

type Phase = 'without' | 'with' | 'decided';

export class Trial {
  /** Whether impostors are wanted now. */
  on = false;
  private readonly options: Required<TrialOptions>;
  private phase: Phase = 'without';
  private times: number[] = [];
  private seen = 0;
  private without = 0;
  private decidedAt = 0;

  constructor(options: TrialOptions = {}) {
    this.options = { frames: 40, warmUp: 15, every: 30, gain: 0.95, enough: 1 / 55, ...options };
  }

  /** Begin anew, as after another cell is shown whose geometry costs something else. */
  restart(): void {
    this.phase = 'without';
    this.on = false;
    this.times = [];
    this.seen = 0;
  }

  /** Tell how long the last frame took and what time it is, both in seconds. */
  frame(seconds: number, now: number): void {
    if (this.phase === 'decided') {
      if (now - this.decidedAt > this.options.every) this.restart();
      return;
    }
    if (++this.seen > this.options.warmUp) this.times.push(seconds);
    if (this.times.length < this.options.frames) return;
    const median = this.times.sort((a, b) => a - b)[this.times.length >> 1];
    this.times = [];
    this.seen = 0;
    if (this.phase === 'without') {
      this.without = median;
      if (median <= this.options.enough) this.decide(false, now);
      else {
        this.phase = 'with';
        this.on = true;
      }
    } else this.decide(median <= this.options.gain * this.without, now);
  }

  private decide(on: boolean, now: number): void {
    this.on = on;
    this.phase = 'decided';
    this.decidedAt = now;
  }
}
