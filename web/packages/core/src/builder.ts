/** Turns downloaded bytes into buffers to draw, here or in a worker. */

import { FarfieldError, asError, AbortedError } from './errors.js';
import type { CellFile, NearReference, Vec3 } from './format.js';
import { WALK_VERSION } from './format.js';
import { buildNearBatches, type NearBatch, type NearSource } from './near.js';
import { CopyList, type Copy } from './objects/copies.js';
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

export interface CellBuilder {
  /** Build a cell from its file's bytes, which may be taken away from the caller. */
  cell(bytes: ArrayBuffer, resolution: number): Promise<BuiltCell>;
  /** Build the near field of the cell of `size` at `centre`. */
  near(sources: readonly NearSource[], centre: Vec3, size: Vec3): Promise<BuiltNear>;
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

function buildNear(sources: readonly NearSource[], centre: Vec3, size: Vec3): BuiltNear {
  const list = new CopyList();
  const batches = buildNearBatches(sources, centre, list);
  return { batches, solid: buildSolid(batches, centre, size), copies: list.copies };
}

/** Builds on the calling thread. */
export class InlineBuilder implements CellBuilder {
  async cell(bytes: ArrayBuffer, resolution: number): Promise<BuiltCell> {
    return Promise.resolve(buildCell(bytes, resolution));
  }

  async near(sources: readonly NearSource[], centre: Vec3, size: Vec3): Promise<BuiltNear> {
    return Promise.resolve(buildNear(sources, centre, size));
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
  | { id: number; kind: 'near'; sources: readonly NearSource[]; centre: Vec3; size: Vec3 }
  | { id: number; kind: 'objects'; batches: readonly Triangles[]; options: FindOptions };

export type BuildReply =
  { id: number; value: BuiltCell | BuiltNear | FoundObjects } | { id: number; error: string };

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

  near(sources: readonly NearSource[], centre: Vec3, size: Vec3): Promise<BuiltNear> {
    return this.ask({ id: this.next++, kind: 'near', sources, centre, size }, []);
  }

  objects(batches: readonly Triangles[], options: FindOptions): Promise<FoundObjects> {
    return this.ask({ id: this.next++, kind: 'objects', batches, options }, []);
  }

  dispose(): void {
    this.worker.terminate();
    this.fail(new AbortedError());
  }

  private ask<T extends BuiltCell | BuiltNear | FoundObjects>(
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

/** Answer one request; the buffers in the reply can be transferred. */
export function answer(request: BuildRequest): { reply: BuildReply; transfer: ArrayBuffer[] } {
  try {
    if (request.kind === 'cell') {
      const value = buildCell(request.bytes, request.resolution);
      const { far, sectors } = value;
      const { indices, starts, boxes } = sectors;
      const arrays = [far.positions, far.texels, indices, starts, boxes];
      return { reply: { id: request.id, value }, transfer: arrays.map(({ buffer }) => buffer) };
    }
    if (request.kind === 'objects') {
      const value = findObjects(request.batches, request.options);
      return {
        reply: { id: request.id, value },
        transfer: value.batches.map(({ indices }) => indices.buffer),
      };
    }
    const value = buildNear(request.sources, request.centre, request.size);
    const { corners, starts, items } = value.solid;
    const transfer = value.batches.flatMap((batch) => [
      batch.positions.buffer,
      batch.normals.buffer,
      batch.uvs.buffer,
      batch.colors.buffer,
      batch.indices.buffer,
      batch.owners.buffer,
    ]);
    transfer.push(corners.buffer, starts.buffer, items.buffer);
    return { reply: { id: request.id, value }, transfer };
  } catch (error) {
    return { reply: { id: request.id, error: asError(error).message }, transfer: [] };
  }
}

/** A builder in a worker where there are workers, otherwise on this thread. */
export function createBuilder(): CellBuilder {
  if (typeof Worker === 'undefined') return new InlineBuilder();
  return new WorkerBuilder(
    new Worker(new URL('./builder-worker.js', import.meta.url), { type: 'module' }),
  );
}
