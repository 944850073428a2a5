/** A cache with a hard cap: what does not fit beside pinned entries is refused, never kept. */

interface Entry<V> {
  readonly value: V;
  bytes: number;
  pins: number;
}

export class LruCache<K, V> {
  readonly capacity: number;
  /** Bytes held now; never above `capacity`. */
  bytes = 0;
  private readonly entries = new Map<K, Entry<V>>();
  private readonly onEvict: (value: V, key: K) => void;

  /** `onEvict` is called once for every value that leaves. */
  constructor(capacity: number, onEvict: (value: V, key: K) => void = () => undefined) {
    this.capacity = capacity;
    this.onEvict = onEvict;
  }

  get size(): number {
    return this.entries.size;
  }

  has(key: K): boolean {
    return this.entries.has(key);
  }

  keys(): IterableIterator<K> {
    return this.entries.keys();
  }

  /** The value, without making it recent. */
  peek(key: K): V | undefined {
    return this.entries.get(key)?.value;
  }

  /** The value, made the most recent. */
  get(key: K): V | undefined {
    const entry = this.entries.get(key);
    if (entry === undefined) return undefined;
    this.entries.delete(key);
    this.entries.set(key, entry);
    return entry.value;
  }

  /**
   * Add an entry as the most recent, evicting unpinned ones from the least recent on.
   * Returns false, changing nothing, if it cannot fit; a key that exists is an error.
   */
  add(key: K, value: V, bytes: number): boolean {
    if (this.entries.has(key)) throw new Error(`The cache already holds ${String(key)}.`);
    if (!this.makeRoom(bytes)) return false;
    this.entries.set(key, { value, bytes, pins: 0 });
    this.bytes += bytes;
    return true;
  }

  /** Change what an entry weighs; false, changing nothing, if it cannot fit. */
  resize(key: K, bytes: number): boolean {
    const entry = this.entries.get(key);
    if (entry === undefined) return false;
    entry.pins++;
    const fits = this.makeRoom(bytes - entry.bytes);
    entry.pins--;
    if (!fits) return false;
    this.bytes += bytes - entry.bytes;
    entry.bytes = bytes;
    return true;
  }

  /** Keep an entry until as many `unpin` calls have come. */
  pin(key: K): void {
    const entry = this.entries.get(key);
    if (entry === undefined) throw new Error(`The cache does not hold ${String(key)}.`);
    entry.pins++;
  }

  unpin(key: K): void {
    const entry = this.entries.get(key);
    if (entry !== undefined && entry.pins > 0) entry.pins--;
  }

  /** Evict one entry whatever its pins; false if it is not there. */
  delete(key: K): boolean {
    const entry = this.entries.get(key);
    if (entry === undefined) return false;
    this.entries.delete(key);
    this.bytes -= entry.bytes;
    this.onEvict(entry.value, key);
    return true;
  }

  clear(): void {
    for (const key of [...this.entries.keys()]) this.delete(key);
  }

  private makeRoom(bytes: number): boolean {
    let free = this.capacity - this.bytes;
    if (free >= bytes) return true;
    const leave: K[] = [];
    for (const [key, entry] of this.entries) {
      if (entry.pins > 0) continue;
      leave.push(key);
      free += entry.bytes;
      if (free >= bytes) break;
    }
    if (free < bytes) return false;
    for (const key of leave) this.delete(key);
    return true;
  }
}
