/**
 * Things that several cells use at once (atlas pages, textures, near blocks): loaded once, kept
 * while used, kept after that as long as the hard cap allows, and called off when nobody waits.
 */

import { AbortedError, FarfieldError, asError } from './errors.js';
import { LruCache } from './lru-cache.js';

/** Who uses a thing; lower priority is more urgent. */
export interface User {
  readonly priority: () => number;
}

export interface Loading {
  /** The most urgent priority among the users. */
  readonly priority: () => number;
  readonly signal: AbortSignal;
  /** Claim memory for the thing; throws FarfieldError 'too-large' if there is no room for it. */
  readonly reserve: (bytes: number) => void;
}

interface Item<V> {
  readonly users: Set<User>;
  readonly abort: AbortController;
  loaded: Promise<V>;
  value: V | undefined;
}

export interface SharedStoreOptions<V> {
  readonly capacity: number;
  readonly load: (key: string, loading: Loading) => Promise<V>;
  /** Called once for everything that leaves, loaded or not. */
  readonly dispose?: (key: string, value: V | undefined) => void;
  /** Asked to free something of lesser priority elsewhere; false if it cannot. */
  readonly pressure?: (priority: number) => boolean;
}

export class SharedStore<V> {
  private readonly cache: LruCache<string, Item<V>>;
  private readonly options: SharedStoreOptions<V>;

  constructor(options: SharedStoreOptions<V>) {
    this.options = options;
    this.cache = new LruCache(options.capacity, (item, key) => {
      item.abort.abort();
      options.dispose?.(key, item.value);
    });
  }

  get bytes(): number {
    return this.cache.bytes;
  }

  get size(): number {
    return this.cache.size;
  }

  /** The thing, once loaded; it stays until this user releases it. */
  acquire(key: string, user: User): Promise<V> {
    const item = this.cache.get(key) ?? this.start(key);
    if (item.users.size === 0) this.cache.pin(key);
    item.users.add(user);
    return item.loaded;
  }

  /** End a user's claim; harmless where there is none. */
  release(key: string, user: User): void {
    const item = this.cache.peek(key);
    if (item?.users.delete(user) !== true || item.users.size > 0) return;
    this.cache.unpin(key);
    if (item.value === undefined) this.cache.delete(key);
  }

  clear(): void {
    this.cache.clear();
  }

  private start(key: string): Item<V> {
    const abort = new AbortController();
    const item: Item<V> = {
      users: new Set(),
      abort,
      loaded: Promise.reject<V>(new AbortedError()),
      value: undefined,
    };
    item.loaded.catch(() => undefined);
    this.cache.add(key, item, 0);
    const priority = (): number =>
      Math.min(Infinity, ...[...item.users].map((user) => user.priority()));
    const reserve = (bytes: number): void => {
      if (abort.signal.aborted) throw new AbortedError();
      while (!this.cache.resize(key, bytes)) {
        if (this.options.pressure?.(priority()) !== true) {
          throw new FarfieldError('too-large', `There is no memory left for ${key}.`);
        }
      }
    };
    // The loader starts in a later task, when the first user is known.
    item.loaded = Promise.resolve()
      .then(() => this.options.load(key, { priority, signal: abort.signal, reserve }))
      .then(
        (value) => {
          if (abort.signal.aborted) {
            throw new AbortedError();
          }
          item.value = value;
          return value;
        },
        (error: unknown) => {
          if (this.cache.peek(key) === item) this.cache.delete(key);
          throw asError(error);
        },
      );
    item.loaded.catch(() => undefined);
    return item;
  }
}
