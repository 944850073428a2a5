/** Turns downloaded bytes into buffers to draw, here or in a worker. */

import { FarfieldError, asError, AbortedError } from './errors.js';
import type { CellFile, NearReference, Vec3 } from './format.js';
import { WALK_VERSION } from './format.js';
import { NearBuild, type NearBatch, type NearSource } from './near.js';
import type { Copy } from './objects/copies.js';
import {
  findObjects,
  type FindOptions,
  type FoundObjects,
  type Triangles,
} from './objects/find-objects.js';
import { buildQuadVertices, type QuadVertices } from './quads.js';
import { sortBySector, type Sectors } from './sectors.js';
import { buildSolid, type SolidData } from './solid.js';

/** What a cell file says, ready to upload. */
export interface BuiltCell {
  readonly centre: Vec3;
  readonly far: Omit<QuadVertices, 'indices'>;
  /** The far triangles, in the order in which they are drawn. */
  readonly sectors: Sectors;
  readonly atlases: readonly string[];
  readonly near: readonly NearReference[];
}

/** The near field of a cell: what to draw and what to bump into. */
export interface BuiltNear {
  readonly batches: NearBatch[];
  readonly solid: SolidData;
  /** What the batches' owners are numbers of. */
  readonly copies: readonly Copy[];
}

/** A near field that is being built. It ends with `finish` or `cancel`. */
export interface NearJob {
  /** Take one block's triangles; its bytes are not needed any more when this settles. */
  add(source: NearSource): Promise<void>;
  finish(): Promise<BuiltNear>;
  /** Forget what was added; harmless at the end. */
  cancel(): void;
}

export interface CellBuilder {
  /** Build a cell from its file's bytes, which may be taken away from the caller. */
  cell(bytes: ArrayBuffer, resolution: number): Promise<BuiltCell>;
  /** Start the near field of the cell of `size` at `centre`. */
  near(centre: Vec3, size: Vec3): NearJob;
  /** Find the objects of a near field; the caller keeps its arrays. */
  objects(batches: readonly Triangles[], options: FindOptions): Promise<FoundObjects>;
  dispose(): void;
}

/** Read a cell file; throws FarfieldError 'format'. */
export function buildCell(bytes: ArrayBuffer, resolution: number): BuiltCell {
  let cell: CellFile;
  try {
    cell = JSON.parse(new TextDecoder().decode(bytes)) as CellFile;
  } catch {
    throw new FarfieldError('format', 'A cell file is not JSON.');
  }
  const { format, version } = cell as { format: unknown; version: unknown };
  if (format !== 'farfield-cell' || version !== WALK_VERSION) {
    throw new FarfieldError('format', 'A cell file is not of the version this viewer reads.');
  }
  const { indices, ...far } = buildQuadVertices(cell, resolution);
  return {
    centre: cell.eyes[0],
    far,
    sectors: sortBySector(far.positions, indices),
    atlases: cell.atlases,
    near: cell.near,
  };
}

function finishNear(build: NearBuild, centre: Vec3, size: Vec3): BuiltNear {
  const batches = build.finish();
  return { batches, solid: buildSolid(batches, centre, size), copies: build.copies };
}

/** Builds on the calling thread. */
export class InlineBuilder implements CellBuilder {
  async cell(bytes: ArrayBuffer, resolution: number): Promise<BuiltCell> {
    return Promise.resolve(buildCell(bytes, resolution));
  }

  near(centre: Vec3, size: Vec3): NearJob {
    const build = new NearBuild(centre);
    return {
      // eslint-disable-next-line @typescript-eslint/require-await -- what is thrown must reject
      add: async (source) => build.add(source),
      finish: () => Promise.resolve(finishNear(build, centre, size)),
      cancel: () => undefined,
    };
  }

  async objects(batches: readonly Triangles[], options: FindOptions): Promise<FoundObjects> {
    return Promise.resolve(findObjects(batches, options));
  }

  dispose(): void {
    return;
  }
}

export type BuildRequest =
  | { id: number; kind: 'cell'; bytes: ArrayBuffer; resolution: number }
  | { id: number; kind: 'near-add'; near: number; source: NearSource; centre: Vec3 }
  | { id: number; kind: 'near-finish'; near: number; centre: Vec3; size: Vec3 }
  | { id: number; kind: 'near-cancel'; near: number }
  | { id: number; kind: 'objects'; batches: readonly Triangles[]; options: FindOptions };

export type BuildReply =
  | { id: number; value: BuiltCell | BuiltNear | FoundObjects | undefined }
  | { id: number; error: string };

interface Waiting {
  readonly resolve: (value: never) => void;
  readonly reject: (error: Error) => void;
}

/** Builds in a worker. */
export class WorkerBuilder implements CellBuilder {
  private readonly worker: Worker;
  private readonly waiting = new Map<number, Waiting>();
  private next = 0;

  constructor(worker: Worker) {
    this.worker = worker;
    worker.onmessage = ({ data }: MessageEvent<BuildReply>) => {
      const waiter = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if ('error' in data) waiter?.reject(new FarfieldError('format', data.error));
      else waiter?.resolve(data.value as never);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      this.fail(new FarfieldError('unsupported', `The worker stopped: ${event.message}.`));
    };
  }

  cell(bytes: ArrayBuffer, resolution: number): Promise<BuiltCell> {
    return this.ask({ id: this.next++, kind: 'cell', bytes, resolution }, [bytes]);
  }

  near(centre: Vec3, size: Vec3): NearJob {
    const near = this.next++;
    let open = false;
    return {
      add: async (source) => {
        open = true;
        await this.ask<undefined>({ id: this.next++, kind: 'near-add', near, source, centre }, []);
      },
      finish: () => {
        open = false;
        return this.ask({ id: this.next++, kind: 'near-finish', near, centre, size }, []);
      },
      cancel: () => {
        const id = this.next++;
        if (open) this.ask<undefined>({ id, kind: 'near-cancel', near }, []).catch(() => undefined);
        open = false;
      },
    };
  }

  objects(batches: readonly Triangles[], options: FindOptions): Promise<FoundObjects> {
    return this.ask({ id: this.next++, kind: 'objects', batches, options }, []);
  }

  dispose(): void {
    this.worker.terminate();
    this.fail(new AbortedError());
  }

  private ask<T extends BuiltCell | BuiltNear | FoundObjects | undefined>(
    request: BuildRequest,
    transfer: Transferable[],
  ): Promise<T> {
    return new Promise<T>((resolve, reject) => {
      this.waiting.set(request.id, { resolve, reject });
      this.worker.postMessage(request, transfer);
    });
  }

  private fail(error: Error): void {
    for (const waiter of this.waiting.values()) waiter.reject(error);
    this.waiting.clear();
  }
}

/** The worker's side: answers requests, and holds the near fields that are being built. */
export class Answerer {
  private readonly builds = new Map<number, NearBuild>();

  /** Near fields under way. */
  get building(): number {
    return this.builds.size;
  }

  /** Answer one request; the buffers in the reply can be transferred. */
  answer(request: BuildRequest): { reply: BuildReply; transfer: ArrayBuffer[] } {
    const { id } = request;
    try {
      const { value, transfer } = this.make(request);
      return { reply: { id, value }, transfer };
    } catch (error) {
      return { reply: { id, error: asError(error).message }, transfer: [] };
    }
  }

  private make(request: BuildRequest): {
    value: BuiltCell | BuiltNear | FoundObjects | undefined;
    transfer: ArrayBuffer[];
  } {
    switch (request.kind) {
      case 'cell': {
        const value = buildCell(request.bytes, request.resolution);
        const { far, sectors } = value;
        const { indices, starts, boxes } = sectors;
        const arrays = [far.positions, far.texels, indices, starts, boxes];
        return { value, transfer: arrays.map(({ buffer }) => buffer) };
      }
      case 'objects': {
        const value = findObjects(request.batches, request.options);
        return { value, transfer: value.batches.map(({ indices }) => indices.buffer) };
      }
      case 'near-add':
        this.near(request.near, request.centre).add(request.source);
        return { value: undefined, transfer: [] };
      case 'near-cancel':
        this.builds.delete(request.near);
        return { value: undefined, transfer: [] };
      case 'near-finish': {
        const build = this.near(request.near, request.centre);
        this.builds.delete(request.near);
        const value = finishNear(build, request.centre, request.size);
        return { value, transfer: buffers(value) };
      }
    }
  }

  private near(number: number, centre: Vec3): NearBuild {
    const build = this.builds.get(number) ?? new NearBuild(centre);
    this.builds.set(number, build);
    return build;
  }
}

function buffers({ batches, solid }: BuiltNear): ArrayBuffer[] {
  const ofBatches = batches.flatMap((batch) => [
    batch.positions.buffer,
    batch.normals.buffer,
    batch.uvs.buffer,
    batch.colors.buffer,
    batch.indices.buffer,
    batch.owners.buffer,
  ]);
  return [...ofBatches, solid.corners.buffer, solid.starts.buffer, solid.items.buffer];
}

/** A builder in a worker where there are workers, otherwise on this thread. */
export function createBuilder(): CellBuilder {
  if (typeof Worker === 'undefined') return new InlineBuilder();
  return new WorkerBuilder(
    new Worker(new URL('./builder-worker.js', import.meta.url), { type: 'module' }),
  );
}
