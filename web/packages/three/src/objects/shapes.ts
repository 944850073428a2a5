/** Objects that repeat in a walk, by the names of their files: loaded once, kept under a cap. */

import {
  FarfieldError,
  SharedStore,
  objectLayers,
  parseObject,
  type FetchQueue,
  type Manifest,
  type User,
} from '@farfield/core';
import { decodeObject, type BakedObject } from './true-impostors.js';

export class Shapes {
  private readonly store: SharedStore<BakedObject>;

  /** @param capacity bytes of textures */
  constructor(manifest: Manifest, queue: FetchQueue, capacity: number) {
    this.store = new SharedStore({
      capacity,
      load: async (name, { priority, signal, reserve }) => {
        const bytes = await queue.get(manifest.nearUrl(name), priority, signal);
        const file = parseObject(new TextDecoder().decode(bytes));
        reserve(4 * file.resolution ** 2 * objectLayers(file));
        return decodeObject(file, await queue.get(manifest.nearUrl(file.image), priority, signal));
      },
      dispose: (_, baked) => baked?.texture.dispose(),
    });
  }

  get bytes(): number {
    return this.store.bytes;
  }

  /** An object; undefined if there is no room for it, and its copies stay polygons. */
  async acquire(name: string, user: User): Promise<BakedObject | undefined> {
    try {
      return await this.store.acquire(name, user);
    } catch (error) {
      if (error instanceof FarfieldError && error.code === 'too-large') return undefined;
      throw error;
    }
  }

  release(name: string, user: User): void {
    this.store.release(name, user);
  }

  clear(): void {
    this.store.clear();
  }
}
