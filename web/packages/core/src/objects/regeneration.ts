/**
 * Whose picture is taken in this frame: nearest and oldest first (Davis, section 8). What waits gains
 * weight with every frame, so nothing waits for ever.
 *
 * How many there are is a matter of what they cost. Objects of one age grow stale together; taken
 * together they would make one long frame, so they are spread over the next few, and no frame spends
 * more on pictures than a budget of time, by what pictures have cost so far.
 */

export interface Waiting {
  /** From the eye to the object, metres. */
  readonly distance: number;
  /** Frames since its picture stopped being good enough. */
  readonly waited: number;
  /** Whether it is drawn as the object it is until it gets a picture. */
  readonly expired: boolean;
  /** See `pictureCost`. */
  readonly cost: number;
}

/** What an object with no usable picture counts more: until its turn comes it costs the most. */
const EXPIRED = 4;
/** Frames over which pictures that are due are spread. */
const SPREAD = 3;
/** A draw call costs as much as this many triangles (Chromium on Mesa: 1,000 to 4,000). */
const CALL = 2000;
/** By how much the measured price may rise from one frame to the next: single frames wait for other things. */
const RISE = 1.05;

/** How much a waiting object presses. */
export function urgency({ distance, waited, expired }: Waiting): number {
  return ((waited + 1) * (expired ? EXPIRED : 1)) / Math.max(distance, 1e-6);
}

/** What taking a picture costs, in triangles. */
export function pictureCost(triangles: number, calls: number): number {
  return triangles + CALL * calls;
}

/**
 * The most urgent ones, most urgent first: at most `most`, and none after those that cost `budget`.
 * One is always among them, or what costs too much would wait for ever.
 */
export function chooseNext<T extends Waiting>(
  waiting: readonly T[],
  most: number,
  budget = Infinity,
): T[] {
  const sorted = [...waiting].sort((a, b) => urgency(b) - urgency(a));
  const chosen: T[] = [];
  let spent = 0;
  for (const one of sorted) {
    if (chosen.length >= most || (chosen.length > 0 && spent >= budget)) break;
    chosen.push(one);
    spent += one.cost;
  }
  return chosen;
}

/** What the pictures of one frame may cost. */
export class PictureBudget {
  private readonly milliseconds: number;
  /** Milliseconds per unit of cost. Until it is known pictures are taken one by one. */
  private rate = Infinity;

  /** @param milliseconds of a frame that may be spent on pictures */
  constructor(milliseconds: number) {
    this.milliseconds = milliseconds;
  }

  /** Tell how long pictures of some cost took. */
  spent(cost: number, milliseconds: number): void {
    if (!(cost > 0)) return;
    this.rate = Math.min(RISE * this.rate, milliseconds / cost);
  }

  /** What may be spent in this frame, where so much is waiting. */
  allowance(waiting: readonly Waiting[]): number {
    const due = waiting.reduce((sum, { cost }) => sum + cost, 0) / SPREAD;
    return Math.min(due, this.milliseconds / this.rate);
  }
}
