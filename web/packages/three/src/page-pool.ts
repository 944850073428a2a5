/**
 * All atlas pages in one texture array of fixed size. Slots are handed out as pages come and taken
 * back from the pages used longest ago, so memory never grows and nothing is allocated on the way.
 */

import {
  FarfieldError,
  PAGES,
  SharedStore,
  type FetchQueue,
  type Loading,
  type Manifest,
  type UploadScheduler,
  type User,
} from '@farfield/core';
import { DataArrayTexture, NearestFilter, type WebGLRenderer } from 'three';
import { decodeImage, uploadBitmap } from './strip-upload.js';

export interface PagePoolOptions {
  readonly renderer: WebGLRenderer;
  readonly manifest: Manifest;
  readonly queue: FetchQueue;
  readonly uploads: UploadScheduler;
  readonly capacity: number;
  readonly pressure: (priority: number) => boolean;
}

export class PagePool {
  readonly texture: DataArrayTexture;
  readonly slots: number;
  readonly pageBytes: number;
  private readonly options: PagePoolOptions;
  private readonly store: SharedStore<number>;
  private readonly free: number[];
  private readonly taken = new Map<string, number>();

  constructor(options: PagePoolOptions) {
    this.options = options;
    const { width, height } = options.manifest.walk.atlas;
    const gl = options.renderer.getContext() as WebGL2RenderingContext;
    const layers = Math.min(PAGES, gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number);
    if (Math.max(width, height) > options.renderer.capabilities.maxTextureSize) {
      throw new FarfieldError(
        'unsupported',
        `Atlas pages of ${width} x ${height} texels are larger than this device can hold; bake with a smaller page.`,
      );
    }
    this.pageBytes = 4 * width * height;
    this.slots = Math.max(1, Math.min(layers, Math.floor(options.capacity / this.pageBytes)));
    this.free = Array.from({ length: this.slots }, (_, n) => this.slots - 1 - n);
    this.texture = new DataArrayTexture(null, width, height, this.slots);
    this.texture.magFilter = NearestFilter;
    this.texture.minFilter = NearestFilter;
    this.texture.generateMipmaps = false;
    // Only the memory is wanted now; pages fill it strip by strip.
    this.texture.source.dataReady = false;
    this.texture.needsUpdate = true;
    options.renderer.initTexture(this.texture);
    this.store = new SharedStore({
      capacity: this.slots * this.pageBytes,
      load: (name, loading) => this.load(name, loading),
      dispose: (name) => {
        const slot = this.taken.get(name);
        if (slot === undefined) return;
        this.taken.delete(name);
        this.free.push(slot);
      },
      pressure: options.pressure,
    });
  }

  /** Bytes of the whole pool, used or not. */
  get bytes(): number {
    return this.slots * this.pageBytes;
  }

  /** The slot of a page, once its texels are there. */
  acquire(name: string, user: User): Promise<number> {
    return this.store.acquire(name, user);
  }

  release(name: string, user: User): void {
    this.store.release(name, user);
  }

  clear(): void {
    this.store.clear();
  }

  dispose(): void {
    this.store.clear();
    this.texture.dispose();
  }

  private async load(name: string, { priority, signal, reserve }: Loading): Promise<number> {
    const { manifest, queue, renderer, uploads } = this.options;
    reserve(this.pageBytes);
    const slot = this.free.pop();
    if (slot === undefined) throw new Error('A page was reserved without a slot.');
    this.taken.set(name, slot);
    const bitmap = await decodeImage(await queue.get(manifest.atlasUrl(name), priority, signal));
    const { width, height } = manifest.walk.atlas;
    if (bitmap.width > width || bitmap.height > height) {
      throw new FarfieldError('format', `Atlas page ${name} is larger than walk.json says.`);
    }
    await uploads.add(uploadBitmap(renderer, bitmap, this.texture, slot), priority, signal);
    return slot;
  }
}
