/**
 * Which way of drawing is fastest, found out by trying: frames are timed in each way by turns, and the
 * fastest is kept until the next trial. Medians, because single frames wait for other things.
 */

export interface TrialOptions {
  /** How many ways there are; the first is the plain one. Default 2. */
  readonly ways?: number;
  /** Frames of each measurement. Default 40. */
  readonly frames?: number;
  /** Frames at the beginning of each that are not counted. Default 15. */
  readonly warmUp?: number;
  /** Seconds between two trials. Default 30. */
  readonly every?: number;
  /** Another way must take no more than this share of the plain one. Default 0.95. */
  readonly gain?: number;
  /** A frame this short needs no help, seconds. Default 1/55. */
  readonly enough?: number;
}

export class Trial {
  /** The way to draw now. */
  way = 0;
  private readonly options: Required<TrialOptions>;
  private decided = false;
  private times: number[] = [];
  private seen = 0;
  /** Median of each way tried so far. */
  private medians: number[] = [];
  private decidedAt = 0;

  constructor(options: TrialOptions = {}) {
    this.options = {
      ways: 2,
      frames: 40,
      warmUp: 15,
      every: 30,
      gain: 0.95,
      enough: 1 / 55,
      ...options,
    };
  }

  /** Begin anew, as after another cell is shown whose geometry costs something else. */
  restart(): void {
    this.way = 0;
    this.decided = false;
    this.times = [];
    this.medians = [];
    this.seen = 0;
  }

  /** Tell how long the last frame took and what time it is, both in seconds. */
  frame(seconds: number, now: number): void {
    const { ways, frames, warmUp, every, gain, enough } = this.options;
    if (this.decided) {
      if (now - this.decidedAt > every) this.restart();
      return;
    }
    if (++this.seen > warmUp) this.times.push(seconds);
    if (this.times.length < frames) return;
    const { medians } = this;
    medians.push(this.times.sort((a, b) => a - b)[this.times.length >> 1]);
    this.times = [];
    this.seen = 0;
    if (medians.length < ways && medians[0] > enough) {
      this.way = medians.length;
      return;
    }
    const fastest = medians.indexOf(Math.min(...medians));
    this.way = medians[fastest] <= gain * medians[0] ? fastest : 0;
    this.decided = true;
    this.decidedAt = now;
  }
}
