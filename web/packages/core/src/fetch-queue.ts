/** Downloads by priority: few at a time, shared, cancellable, tried again with back-off. */

import { AbortedError, FarfieldError, asError, isAborted } from './errors.js';

export interface FetchQueueOptions {
  /** Replaces the global fetch. */
  readonly fetch?: (url: string, init: { signal: AbortSignal }) => Promise<Response>;
  /** Requests under way at once. */
  readonly concurrency?: number;
  /** Further attempts after the first, for what may pass: no answer, 429 and 5xx. */
  readonly retries?: number;
  /** Waiting time before attempt n + 1, milliseconds. */
  readonly backoff?: (attempt: number) => number;
}

interface Waiter {
  readonly priority: () => number;
  readonly resolve: (bytes: ArrayBuffer) => void;
  readonly reject: (error: Error) => void;
}

interface Request {
  readonly url: string;
  readonly waiters: Set<Waiter>;
  readonly abort: AbortController;
  running: boolean;
}

/** Doubles from half a second to thirty, half of it at random so that clients do not march in step. */
export function defaultBackoff(attempt: number): number {
  return Math.min(30_000, 500 * 2 ** attempt) * (0.5 + 0.5 * Math.random());
}

export class FetchQueue {
  /** Bytes that have arrived. */
  bytes = 0;
  /** Requests that have been answered. */
  finished = 0;
  private readonly requests = new Map<string, Request>();
  private active = 0;
  private readonly options: Required<FetchQueueOptions>;

  constructor(options: FetchQueueOptions = {}) {
    this.options = {
      fetch: options.fetch ?? ((url, init) => fetch(url, init)),
      concurrency: options.concurrency ?? 6,
      retries: options.retries ?? 4,
      backoff: options.backoff ?? defaultBackoff,
    };
  }

  /** Requests waiting or under way. */
  get pending(): number {
    return this.requests.size;
  }

  /**
   * The bytes at `url`. Lower `priority` goes first and is asked whenever a place becomes free.
   * Callers that ask for the same address share one request, which ends early only when all of
   * them have called off. Rejects with FarfieldError ('not-found' for 404, 'network' otherwise) or
   * AbortedError.
   */
  get(url: string, priority: () => number = () => 0, signal?: AbortSignal): Promise<ArrayBuffer> {
    return new Promise((resolve, reject) => {
      if (signal?.aborted === true) {
        reject(new AbortedError());
        return;
      }
      let request = this.requests.get(url);
      if (request === undefined) {
        request = { url, waiters: new Set(), abort: new AbortController(), running: false };
        this.requests.set(url, request);
      }
      const shared = request;
      const waiter: Waiter = {
        priority,
        resolve: (bytes) => {
          signal?.removeEventListener('abort', leave);
          resolve(bytes);
        },
        reject: (error) => {
          signal?.removeEventListener('abort', leave);
          reject(error);
        },
      };
      const leave = (): void => {
        shared.waiters.delete(waiter);
        if (shared.waiters.size === 0) {
          if (this.requests.get(url) === shared) this.requests.delete(url);
          shared.abort.abort();
        }
        reject(new AbortedError());
      };
      signal?.addEventListener('abort', leave, { once: true });
      shared.waiters.add(waiter);
      this.pump();
    });
  }

  private pump(): void {
    while (this.active < this.options.concurrency) {
      let best: Request | undefined;
      let bestPriority = Infinity;
      for (const request of this.requests.values()) {
        if (request.running) continue;
        const priority = Math.min(...[...request.waiters].map((waiter) => waiter.priority()));
        if (best === undefined || priority < bestPriority) {
          best = request;
          bestPriority = priority;
        }
      }
      if (best === undefined) return;
      void this.serve(best);
    }
  }

  private async serve(request: Request): Promise<void> {
    request.running = true;
    this.active++;
    let settle: (waiter: Waiter) => void;
    try {
      const bytes = await this.attempts(request);
      this.bytes += bytes.byteLength;
      settle = (waiter) => waiter.resolve(bytes);
    } catch (thrown) {
      const error = isAborted(thrown) ? new AbortedError() : asError(thrown);
      settle = (waiter) => waiter.reject(error);
    }
    this.active--;
    this.finished++;
    if (this.requests.get(request.url) === request) this.requests.delete(request.url);
    for (const waiter of request.waiters) settle(waiter);
    this.pump();
  }

  private async attempts(request: Request): Promise<ArrayBuffer> {
    const { signal } = request.abort;
    for (let attempt = 0; ; attempt++) {
      let problem: string;
      try {
        const response = await this.options.fetch(request.url, { signal });
        if (response.ok) return await response.arrayBuffer();
        if (response.status === 404 || response.status === 410) {
          throw new FarfieldError('not-found', `There is nothing at ${request.url}.`);
        }
        problem = `the server answered ${response.status}`;
        if (response.status < 500 && response.status !== 429) {
          throw new FarfieldError('network', `${request.url} could not be loaded: ${problem}.`);
        }
      } catch (error) {
        if (error instanceof FarfieldError || signal.aborted) throw error;
        problem = 'the network did not answer';
      }
      if (attempt >= this.options.retries) {
        throw new FarfieldError('network', `${request.url} could not be loaded: ${problem}.`);
      }
      await pause(this.options.backoff(attempt), signal);
    }
  }
}

/** Wait, unless called off. */
export function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const stop = (): void => {
      clearTimeout(timer);
      reject(new AbortedError());
    };
    const timer = setTimeout(() => {
      signal.removeEventListener('abort', stop);
      resolve();
    }, milliseconds);
    if (signal.aborted) stop();
    else signal.addEventListener('abort', stop, { once: true });
  });
}
