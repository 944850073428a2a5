/** What can go wrong, in words a person can act on. */

export type ErrorCode = 'not-found' | 'network' | 'format' | 'unsupported' | 'too-large';

/** One sentence saying what is wrong and, where it helps, what to do. */
export class FarfieldError extends Error {
  readonly code: ErrorCode;

  constructor(code: ErrorCode, message: string) {
    super(message);
    this.name = 'FarfieldError';
    this.code = code;
  }
}

/** Thrown by whatever was called off through its AbortSignal. */
export class AbortedError extends Error {
  constructor() {
    super('The request was called off.');
    this.name = 'AbortedError';
  }
}

export function isAborted(error: unknown): boolean {
  return (
    error instanceof AbortedError || (error instanceof DOMException && error.name === 'AbortError')
  );
}

/** Anything thrown, as an Error. */
export function asError(error: unknown): Error {
  return error instanceof Error ? error : new Error(String(error));
}
