/** The REST API as the pages use it (docs/api.md). Every failure is one sentence. */

export type Triple = readonly [number, number, number];

export interface Bounds {
  readonly min: Triple;
  readonly max: Triple;
}

export interface MapPicture {
  readonly width: number;
  readonly height: number;
  /** x and z of the upper left and the lower right corner. */
  readonly min: readonly [number, number];
  readonly max: readonly [number, number];
}

export interface Orientation {
  readonly up: 'y' | 'z';
  readonly scale: number;
}

export interface Scene {
  readonly id: string;
  readonly name: string;
  readonly state: 'preparing' | 'ready' | 'refused';
  readonly reason: string | null;
  readonly bounds: Bounds | null;
  readonly triangles: number | null;
  readonly textures: number | null;
  readonly notes: readonly string[];
  readonly orientation: Orientation;
  readonly suspected: Orientation | null;
  readonly map: MapPicture | null;
}

export interface Corridor {
  readonly box?: Bounds | null;
  readonly path?: {
    readonly points: readonly Triple[];
    readonly width: number;
    readonly height: number;
  } | null;
  readonly follow_ground: boolean;
  readonly eye_height: number;
}

export interface Suggestion {
  readonly corridor: Corridor;
  readonly cell_size: number;
  readonly eye_height: number;
}

export interface Plan {
  readonly cells: number;
  readonly near_field: number;
  readonly megabytes: number;
  readonly seconds: number;
}

export interface Wanted {
  readonly scene: string;
  readonly corridor: Corridor;
  readonly settings: Readonly<Record<string, unknown>>;
}

export type BakeState = 'queued' | 'running' | 'paused' | 'cancelled' | 'done' | 'failed';

export interface Bake {
  readonly id: string;
  readonly name: string;
  readonly scene: string;
  readonly state: BakeState;
  readonly reason: string | null;
  readonly cells: { readonly total: number; readonly done: number; readonly failed: number };
  readonly rate: number | null;
  readonly seconds_left: number | null;
  readonly failures: readonly { readonly cell: string; readonly reason: string }[];
}

export interface UploadStatus {
  readonly state: 'receiving' | 'importing' | 'done' | 'refused';
  readonly scene: string | null;
  readonly reason: string | null;
}

/** What the server said, or that it said nothing. */
export class ApiError extends Error {
  readonly status: number;

  constructor(status: number, message: string) {
    super(message);
    this.status = status;
  }
}

/** The server's root: everything before the name of a page. */
export function rootOf(page: URL): URL {
  const path = page.pathname.replace(/(?:(?:scene|bake)\/[^/]*\/?|index\.html)$/, '');
  return new URL(path.endsWith('/') ? path : `${path}/`, page.origin);
}

export function address(path: string): string {
  return new URL(path, rootOf(new URL(location.href))).href;
}

export function apiAddress(path: string): string {
  return address(`api/v1/${path}`);
}

/** The sentence of a problem-details answer. */
export function sentenceOf(status: number, body: string): string {
  try {
    const detail: unknown = (JSON.parse(body) as { detail?: unknown }).detail;
    if (typeof detail === 'string') return detail;
  } catch {
    // not from this API: some server in between
  }
  return `The server answered ${status}; try again.`;
}

async function request(path: string, init: RequestInit): Promise<unknown> {
  let answer: Response;
  try {
    answer = await fetch(apiAddress(path), init);
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error;
    throw new ApiError(0, 'The server cannot be reached; check the connection and try again.');
  }
  const text = await answer.text();
  if (!answer.ok) throw new ApiError(answer.status, sentenceOf(answer.status, text));
  return text === '' ? undefined : JSON.parse(text);
}

export async function get<T>(path: string, signal?: AbortSignal): Promise<T> {
  return (await request(path, { signal: signal ?? null })) as T;
}

export async function post<T>(path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  const init: RequestInit = { method: 'POST', signal: signal ?? null };
  if (body !== undefined) {
    init.body = JSON.stringify(body);
    init.headers = { 'Content-Type': 'application/json' };
  }
  return (await request(path, init)) as T;
}

/** What to tell the user of something that was thrown. */
export function tell(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
