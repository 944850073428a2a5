/**
 * Whose picture is taken in this frame: at most so many, nearest and oldest first (Davis, section 8).
 * What waits gains weight with every frame, so nothing waits for ever.
 */

export interface Waiting {
  /** From the eye to the object, metres. */
  readonly distance: number;
  /** Frames since its picture stopped being good enough. */
  readonly waited: number;
  /** Whether it is drawn as the object it is until it gets a picture. */
  readonly expired: boolean;
}

/** What an object with no usable picture counts more: until its turn comes it costs the most. */
const EXPIRED = 4;

/** How much a waiting object presses. */
export function urgency({ distance, waited, expired }: Waiting): number {
  return ((waited + 1) * (expired ? EXPIRED : 1)) / Math.max(distance, 1e-6);
}

/** The `most` most urgent ones, most urgent first. */
export function chooseNext<T extends Waiting>(waiting: readonly T[], most: number): T[] {
  if (waiting.length <= 1) return waiting.slice(0, Math.max(0, most));
  return [...waiting].sort((a, b) => urgency(b) - urgency(a)).slice(0, Math.max(0, most));
}
