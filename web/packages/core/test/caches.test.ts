import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { AbortedError, FarfieldError, LruCache, SharedStore, type Loading } from '../src/index.js';

describe('LruCache', () => {
  const operation = fc.oneof(
    fc.record({
      do: fc.constant('add' as const),
      key: fc.nat(9),
      bytes: fc.integer({ min: 0, max: 60 }),
    }),
    fc.record({ do: fc.constant('get' as const), key: fc.nat(9), bytes: fc.constant(0) }),
    fc.record({ do: fc.constant('pin' as const), key: fc.nat(9), bytes: fc.constant(0) }),
    fc.record({ do: fc.constant('unpin' as const), key: fc.nat(9), bytes: fc.constant(0) }),
    fc.record({ do: fc.constant('delete' as const), key: fc.nat(9), bytes: fc.constant(0) }),
    fc.record({
      do: fc.constant('resize' as const),
      key: fc.nat(9),
      bytes: fc.integer({ min: 0, max: 60 }),
    }),
  );

  test('does what a list in order of use would do, and never holds more than it may', () => {
    fc.assert(
      fc.property(fc.array(operation, { maxLength: 80 }), (operations) => {
        const evicted: number[] = [];
        const cache = new LruCache<number, number>(100, (_, key) => evicted.push(key));
        let model: { key: number; bytes: number; pins: number }[] = [];
        const gone: number[] = [];
        const total = (): number => model.reduce((sum, { bytes }) => sum + bytes, 0);
        /** Evict from the front until `bytes` fit, or change nothing. */
        const room = (bytes: number, keep?: number): boolean => {
          const stay = model.filter(({ pins, key }) => pins > 0 || key === keep);
          if (stay.reduce((sum, entry) => sum + entry.bytes, 0) + bytes > 100) return false;
          while (total() + bytes > 100) {
            const leave = model.find(({ pins, key }) => pins === 0 && key !== keep);
            model = model.filter((entry) => entry !== leave);
            if (leave !== undefined) gone.push(leave.key);
          }
          return true;
        };
        for (const { do: what, key, bytes } of operations) {
          const entry = model.find((candidate) => candidate.key === key);
          if (what === 'add' && entry === undefined) {
            const fits = room(bytes);
            expect(cache.add(key, key, bytes)).toBe(fits);
            if (fits) model.push({ key, bytes, pins: 0 });
          } else if (what === 'get') {
            expect(cache.get(key)).toBe(entry?.key);
            if (entry !== undefined) model = [...model.filter((e) => e !== entry), entry];
          } else if (what === 'pin' && entry !== undefined) {
            cache.pin(key);
            entry.pins++;
          } else if (what === 'unpin') {
            cache.unpin(key);
            if (entry !== undefined) entry.pins = Math.max(0, entry.pins - 1);
          } else if (what === 'delete') {
            expect(cache.delete(key)).toBe(entry !== undefined);
            if (entry !== undefined) gone.push(key);
            model = model.filter((e) => e !== entry);
          } else if (what === 'resize') {
            const fits = entry !== undefined && room(bytes - entry.bytes, key);
            expect(cache.resize(key, bytes)).toBe(fits);
            if (fits) entry.bytes = bytes;
          }
          expect([...cache.keys()]).toEqual(model.map((e) => e.key));
          expect(cache.bytes).toBe(total());
          expect(cache.bytes).toBeLessThanOrEqual(100);
          expect(evicted).toEqual(gone);
        }
      }),
    );
  });

  test('a key is added once, and pins need an entry', () => {
    const cache = new LruCache<string, number>(10);
    cache.add('a', 1, 1);
    expect(() => cache.add('a', 2, 1)).toThrow('already');
    expect(() => cache.pin('b')).toThrow('does not hold');
  });
});

describe('SharedStore', () => {
  const user = (priority = 0): { priority: () => number } => ({ priority: () => priority });

  interface Load {
    key: string;
    loading: Loading;
    resolve: (value: string) => void;
    reject: (error: Error) => void;
  }

  function setUp(capacity = 100, pressure?: (priority: number) => boolean) {
    const loads: Load[] = [];
    const disposed: string[] = [];
    const store = new SharedStore<string>({
      capacity,
      load: (key, loading) =>
        new Promise((resolve, reject) => loads.push({ key, loading, resolve, reject })),
      dispose: (key) => disposed.push(key),
      ...(pressure && { pressure }),
    });
    return { store, loads, disposed };
  }

  const tick = (): Promise<void> => new Promise((resolve) => setTimeout(resolve));

  test('two users share one load, whose priority is the more urgent one’s', async () => {
    const { store, loads } = setUp();
    const both = [store.acquire('a', user(5)), store.acquire('a', user(2))];
    await tick();
    expect(loads).toHaveLength(1);
    expect(loads[0].loading.priority()).toBe(2);
    loads[0].resolve('value');
    expect(await Promise.all(both)).toEqual(['value', 'value']);
  });

  test('a load is called off when its last user leaves, and not before', async () => {
    const { store, loads, disposed } = setUp();
    const [one, two] = [user(), user()];
    const waiting = store.acquire('a', one);
    waiting.catch(() => undefined);
    void store.acquire('a', two).catch(() => undefined);
    await tick();
    store.release('a', one);
    expect(loads[0].loading.signal.aborted).toBe(false);
    store.release('a', two);
    expect(loads[0].loading.signal.aborted).toBe(true);
    expect(disposed).toEqual(['a']);
    loads[0].resolve('too late');
    await expect(waiting).rejects.toBeInstanceOf(AbortedError);
  });

  test('what nobody uses stays until its memory is needed', async () => {
    const { store, loads, disposed } = setUp();
    const [one, two] = [user(), user()];
    for (const [key, who] of [
      ['a', one],
      ['b', two],
    ] as const) {
      const loaded = store.acquire(key, who);
      await tick();
      loads[loads.length - 1].loading.reserve(50);
      loads[loads.length - 1].resolve(key);
      await loaded;
    }
    store.release('a', one);
    expect(disposed).toEqual([]);
    expect(store.bytes).toBe(100);
    void store.acquire('c', user()).catch(() => undefined);
    await tick();
    loads[2].loading.reserve(40);
    expect(disposed).toEqual(['a']);
    expect(store.bytes).toBe(90);
    expect(() => loads[2].loading.reserve(60)).toThrow(FarfieldError);
  });

  test('pressure elsewhere makes room', async () => {
    const held: (() => void)[] = [];
    const { store, loads } = setUp(100, () => {
      const free = held.pop();
      free?.();
      return free !== undefined;
    });
    const first = user();
    const loaded = store.acquire('a', first);
    await tick();
    loads[0].loading.reserve(80);
    loads[0].resolve('a');
    await loaded;
    held.push(() => store.release('a', first));
    void store.acquire('b', user()).catch(() => undefined);
    await tick();
    loads[1].loading.reserve(60);
    expect(store.bytes).toBe(60);
  });

  test('a failed load is tried again by the next user', async () => {
    const { store, loads, disposed } = setUp();
    const failing = store.acquire('a', user());
    await tick();
    loads[0].reject(new Error('broken'));
    await expect(failing).rejects.toThrow('broken');
    expect(disposed).toEqual(['a']);
    const again = store.acquire('a', user());
    await tick();
    loads[1].resolve('fine');
    expect(await again).toBe('fine');
  });
});
