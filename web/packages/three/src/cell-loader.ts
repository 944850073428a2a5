/** Brings one cell from its file to a complete view: pages, near blocks, textures, buffers. */

import {
  FarfieldError,
  SharedStore,
  Solid,
  type BuiltCell,
  type BuiltNear,
  type CellBuilder,
  type Copy,
  type FetchQueue,
  type Job,
  type Loaded,
  type Manifest,
  type NearBatch,
  type NearState,
  type NearTexture,
  type User,
  type Vec3,
} from '@farfield/core';
import type { RawShaderMaterial, Texture } from 'three';
import type { AttributeUpload } from './attribute-upload.js';
import { CellView } from './cell-view.js';
import type { NearMaterials } from './near-materials.js';
import { CellCopies } from './objects/cell-copies.js';
import type { Shapes } from './objects/shapes.js';
import type { NearTextures } from './near-textures.js';
import type { PagePool } from './page-pool.js';

/** Bytes of downloaded near blocks that are kept for the next cell. */
const BLOCK_BYTES = 48 * 2 ** 20;
/** Near blocks of a cell that are fetched and held at once; more than a queue's requests at once. */
const AHEAD = 8;

export interface CellLoaderParts {
  readonly manifest: Manifest;
  readonly queue: FetchQueue;
  readonly builder: CellBuilder;
  readonly pages: PagePool;
  readonly textures: NearTextures;
  readonly materials: NearMaterials;
  readonly farMaterial: RawShaderMaterial;
  readonly attributes: AttributeUpload;
  /** Objects that repeat; undefined where they are drawn as polygons. */
  readonly shapes: Shapes | undefined;
  /** Make the view's shader programs ready. */
  readonly compile: (view: CellView) => Promise<void>;
}

interface Near {
  readonly batches: NearBatch[];
  readonly solid: Solid;
  readonly textures: Map<NearTexture, Texture>;
  readonly copies: CellCopies | undefined;
}

export class CellLoader {
  private readonly parts: CellLoaderParts;
  private readonly blocks: SharedStore<ArrayBuffer>;

  constructor(parts: CellLoaderParts) {
    this.parts = parts;
    const { manifest, queue } = parts;
    this.blocks = new SharedStore({
      capacity: BLOCK_BYTES,
      load: async (name, { priority, signal, reserve }) => {
        const bytes = await queue.get(manifest.nearUrl(name), priority, signal);
        // More than fits is used all the same, but not kept.
        if (bytes.byteLength < BLOCK_BYTES / 4) reserve(bytes.byteLength);
        return bytes;
      },
    });
  }

  /** Load a cell; what it holds is released by disposing of the view, or here on failure. */
  async load(job: Job): Promise<Loaded<CellView>> {
    const { manifest, queue, builder } = this.parts;
    const bytes = await queue.get(manifest.cellUrl(job.cell.name), job.priority, job.signal);
    const cell = await builder.cell(bytes, manifest.walk.resolution);
    job.signal.throwIfAborted();
    const held: (() => void)[] = [];
    const release = (): void => held.splice(0).forEach((free) => free());
    // At once, not when the load notices: another cell may be waiting for this memory.
    job.signal.addEventListener('abort', release, { once: true });
    try {
      const view = await this.build(cell, job, held, release);
      return { view, bytes: view.bytes };
    } catch (error) {
      release();
      // Only the cell's own file may be missing: then it is not baked yet.
      if (error instanceof FarfieldError && error.code === 'not-found') {
        throw new FarfieldError('network', `A part of the cell is missing. ${error.message}`);
      }
      throw error;
    } finally {
      job.signal.removeEventListener('abort', release);
    }
  }

  dispose(): void {
    this.blocks.clear();
  }

  private async build(
    cell: BuiltCell,
    job: Job,
    held: (() => void)[],
    release: () => void,
  ): Promise<CellView> {
    const { pages, materials, farMaterial, attributes, compile } = this.parts;
    const user: User = { priority: job.priority };
    const allSlots = settleAll(
      cell.atlases.map((name) => {
        held.push(() => pages.release(name, user));
        return abortable(pages.acquire(name, user), job.signal);
      }),
    );
    const allNear = this.near(cell, job, user, held);
    await Promise.allSettled([allSlots, allNear]);
    const slots = await allSlots;
    const { batches, solid, textures, copies } = await allNear;
    const view = new CellView(
      cell,
      slots,
      farMaterial,
      batches,
      batches.map(({ state }) =>
        materials.get(
          state,
          state.map === undefined ? undefined : textures.get(state.map),
          state.emissiveMap === undefined ? undefined : textures.get(state.emissiveMap),
        ),
      ),
      solid,
      release,
      copies,
    );
    try {
      await compile(view);
      await attributes.add(view.geometries, user, job.signal);
      job.signal.throwIfAborted();
    } catch (error) {
      view.dispose();
      throw error;
    }
    return view;
  }

  private async near(cell: BuiltCell, job: Job, user: User, held: (() => void)[]): Promise<Near> {
    const built = await this.blocksOf(cell, job, user, held);
    job.signal.throwIfAborted();
    const batches = built.batches.map((batch) => ({ ...batch, state: this.absolute(batch.state) }));
    const wanted = batches
      .flatMap(({ state }) => [state.map, state.emissiveMap])
      .filter((texture) => texture !== undefined);
    const textures = await settleAll(
      wanted.map(async (texture) => {
        held.push(() => this.parts.textures.release(texture, user));
        const loaded = await abortable(this.parts.textures.acquire(texture, user), job.signal);
        return [texture, loaded] as const;
      }),
    );
    return {
      batches,
      solid: new Solid(built.solid),
      textures: new Map(textures),
      copies: await this.copies(batches, built.copies, cell.centre, job, user, held),
    };
  }

  /**
   * Build the near field block after block, in the file's order. Only a few blocks are held at once:
   * a near field may be larger than all that is kept of blocks.
   */
  private async blocksOf(
    { near, centre }: BuiltCell,
    job: Job,
    user: User,
    held: (() => void)[],
  ): Promise<BuiltNear> {
    const build = this.parts.builder.near(centre, this.parts.manifest.walk.grid.size);
    const ahead: Promise<ArrayBuffer>[] = [];
    const fetch = (blob: string): void => {
      held.push(() => this.blocks.release(blob, user));
      const bytes = abortable(this.blocks.acquire(blob, user), job.signal);
      bytes.catch(() => undefined);
      ahead.push(bytes);
    };
    let next = 0;
    try {
      for (const { blob, ranges } of near) {
        while (next < near.length && ahead.length < AHEAD) fetch(near[next++].blob);
        const [first] = ahead.splice(0, 1);
        await build.add({ bytes: await first, ranges });
        this.blocks.release(blob, user);
        job.signal.throwIfAborted();
      }
      return await build.finish();
    } catch (error) {
      build.cancel();
      throw error;
    }
  }

  private async copies(
    batches: readonly NearBatch[],
    copies: readonly Copy[],
    centre: Vec3,
    job: Job,
    user: User,
    held: (() => void)[],
  ): Promise<CellCopies | undefined> {
    const { shapes, manifest, materials } = this.parts;
    if (shapes === undefined || copies.length === 0) return undefined;
    const names = [...new Set(copies.map(({ shape }) => shape))];
    const loaded = await settleAll(
      names.map(async (name) => {
        held.push(() => shapes.release(name, user));
        return [name, await abortable(shapes.acquire(name, user), job.signal)] as const;
      }),
    );
    const { grid, near_field } = manifest.walk;
    return new CellCopies(batches, {
      copies,
      shapes: new Map(
        loaded.flatMap(([name, baked]) => (baked === undefined ? [] : [[name, baked]])),
      ),
      space: { centre, size: grid.size, nearField: near_field },
      light: materials.light,
      fade: materials.fade,
    });
  }

  /** The state with its textures' addresses made absolute, so that blocks share them. */
  private absolute(state: NearState): NearState {
    const resolve = (texture: NearTexture | undefined): NearTexture | undefined =>
      texture && { ...texture, uri: this.parts.manifest.nearUrl(texture.uri) };
    return { ...state, map: resolve(state.map), emissiveMap: resolve(state.emissiveMap) };
  }
}

/** Promise.all that waits until all have settled, so nothing is acquired after a release. */
async function settleAll<T>(promises: readonly Promise<T>[]): Promise<T[]> {
  const results = await Promise.allSettled(promises);
  return results.map((result) => {
    if (result.status === 'rejected') throw result.reason;
    return result.value;
  });
}

/** A shared promise, left early when this user calls off. */
function abortable<T>(promise: Promise<T>, signal: AbortSignal): Promise<T> {
  return new Promise((resolve, reject) => {
    const stop = (): void => {
      reject(new DOMException('The cell is no longer wanted.', 'AbortError'));
    };
    if (signal.aborted) stop();
    signal.addEventListener('abort', stop, { once: true });
    promise.then(resolve, reject).finally(() => signal.removeEventListener('abort', stop));
  });
}
