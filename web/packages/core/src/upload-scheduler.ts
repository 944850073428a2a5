/** Spreads uploads over frames: a few steps a frame, at most so many bytes, most urgent first. */

import { AbortedError, asError } from './errors.js';

/** One piece of an upload that cannot be divided further. */
export interface UploadStep {
  readonly bytes: number;
  readonly run: () => void;
}

interface Upload {
  readonly steps: Iterator<UploadStep>;
  next: UploadStep | undefined;
  readonly priority: () => number;
  readonly signal: AbortSignal | undefined;
  readonly resolve: () => void;
  readonly reject: (error: Error) => void;
}

export class UploadScheduler {
  private uploads: Upload[] = [];

  /** Uploads that have not finished. */
  get pending(): number {
    return this.uploads.length;
  }

  /**
   * Queue an upload; the promise settles when its last step has run. Steps are taken lazily, in
   * order. Lower `priority` goes first and is asked every frame.
   */
  add(
    steps: Iterable<UploadStep>,
    priority: () => number = () => 0,
    signal?: AbortSignal,
  ): Promise<void> {
    return new Promise((resolve, reject) => {
      this.uploads.push({
        steps: steps[Symbol.iterator](),
        next: undefined,
        priority,
        signal,
        resolve,
        reject,
      });
    });
  }

  /**
   * Run steps up to `budget` bytes and return the bytes run. A single step larger than the budget
   * runs alone in its frame.
   */
  frame(budget: number): number {
    let spent = 0;
    const order = this.uploads
      .map((upload) => ({ upload, priority: upload.priority() }))
      .sort((a, b) => a.priority - b.priority);
    for (const { upload } of order) {
      for (;;) {
        const state = this.advance(upload, budget - spent, spent === 0);
        if (state === 'over') return spent;
        if (state === 'done') break;
        spent += state;
      }
    }
    return spent;
  }

  /** Run one step; its bytes, or 'done' if none is left, or 'over' if it exceeds what is left. */
  private advance(upload: Upload, left: number, first: boolean): number | 'done' | 'over' {
    try {
      if (upload.signal?.aborted === true) throw new AbortedError();
      if (upload.next === undefined) {
        const item = upload.steps.next();
        if (item.done === true) {
          this.remove(upload);
          upload.resolve();
          return 'done';
        }
        upload.next = item.value;
      }
      const step = upload.next;
      if (step.bytes > left && !first) return 'over';
      upload.next = undefined;
      step.run();
      return step.bytes;
    } catch (error) {
      this.remove(upload);
      upload.reject(asError(error));
      return 'done';
    }
  }

  private remove(upload: Upload): void {
    this.uploads = this.uploads.filter((other) => other !== upload);
  }
}

/** Divide `rows` rows of `rowBytes` bytes into [first, end) strips of at most `maxBytes` (or one row). */
export function strips(rows: number, rowBytes: number, maxBytes: number): [number, number][] {
  const each = Math.max(1, Math.floor(maxBytes / rowBytes));
  const parts = Math.ceil(rows / each);
  return Array.from({ length: parts }, (_, n): [number, number] => [
    n * each,
    Math.min(rows, (n + 1) * each),
  ]);
}
