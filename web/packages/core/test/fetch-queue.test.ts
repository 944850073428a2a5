import { describe, expect, test } from 'vitest';
import { AbortedError, FarfieldError, FetchQueue, defaultBackoff } from '../src/index.js';

interface Call {
  url: string;
  signal: AbortSignal;
  answer: (status?: number) => void;
  fail: () => void;
}

function setUp(concurrency = 2, retries = 2) {
  const calls: Call[] = [];
  const waits: number[] = [];
  const queue = new FetchQueue({
    concurrency,
    retries,
    backoff: (attempt) => {
      waits.push(attempt);
      return 1;
    },
    fetch: (url, { signal }) =>
      new Promise((resolve, reject) => {
        signal.addEventListener('abort', () => reject(new DOMException('', 'AbortError')));
        calls.push({
          url,
          signal,
          answer: (status = 200) => resolve(new Response(status === 204 ? null : url, { status })),
          fail: () => reject(new TypeError('network')),
        });
      }),
  });
  return { queue, calls, waits };
}

const until = async (condition: () => boolean): Promise<void> => {
  for (let n = 0; n < 1000; n++) {
    if (condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 1));
  }
  throw new Error('It never happened.');
};
const text = (bytes: ArrayBuffer): string => new TextDecoder().decode(bytes);

describe('FetchQueue', () => {
  test('few at once, the most urgent first, asked when a place is free', async () => {
    const { queue, calls } = setUp(1);
    let late = 9;
    const all = [
      queue.get('http://x/0', () => 5),
      queue.get('http://x/1', () => 3),
      queue.get('http://x/2', () => late),
    ];
    expect(calls.map(({ url }) => url)).toEqual(['http://x/0']);
    late = 1;
    calls[0].answer();
    await until(() => calls.length === 2);
    calls[1].answer();
    await until(() => calls.length === 3);
    calls[2].answer();
    expect((await Promise.all(all)).map(text)).toEqual(['http://x/0', 'http://x/1', 'http://x/2']);
    expect(calls.map(({ url }) => url)).toEqual(['http://x/0', 'http://x/2', 'http://x/1']);
    expect(queue.pending).toBe(0);
    expect(queue.bytes).toBe(30);
  });

  test('callers share a request, which ends when all have called off', async () => {
    const { queue, calls } = setUp();
    const [one, two] = [new AbortController(), new AbortController()];
    const a = queue.get('http://x/a', undefined, one.signal);
    const b = queue.get('http://x/a', undefined, two.signal);
    expect(calls).toHaveLength(1);
    one.abort();
    await expect(a).rejects.toBeInstanceOf(AbortedError);
    expect(calls[0].signal.aborted).toBe(false);
    two.abort();
    await expect(b).rejects.toBeInstanceOf(AbortedError);
    expect(calls[0].signal.aborted).toBe(true);
    const again = queue.get('http://x/a');
    await until(() => calls.length === 2);
    calls[1].answer();
    expect(text(await again)).toBe('http://x/a');
  });

  test('one who waits in the queue can leave it', async () => {
    const { queue, calls } = setUp(1);
    const first = queue.get('http://x/0');
    const abort = new AbortController();
    const second = queue.get('http://x/1', undefined, abort.signal);
    abort.abort();
    await expect(second).rejects.toBeInstanceOf(AbortedError);
    calls[0].answer();
    await first;
    expect(calls).toHaveLength(1);
  });

  test('tries again after no answer, 500 and 429, waiting longer each time', async () => {
    const { queue, calls, waits } = setUp(1, 3);
    const wanted = queue.get('http://x/0');
    calls[0].fail();
    await until(() => calls.length === 2);
    calls[1].answer(503);
    await until(() => calls.length === 3);
    calls[2].answer(429);
    await until(() => calls.length === 4);
    calls[3].answer();
    expect(text(await wanted)).toBe('http://x/0');
    expect(waits).toEqual([0, 1, 2]);
  });

  test('gives up in words', async () => {
    const { queue, calls } = setUp(1, 1);
    const wanted = queue.get('http://x/0');
    calls[0].answer(500);
    await until(() => calls.length === 2);
    calls[1].answer(500);
    await expect(wanted).rejects.toThrow('the server answered 500');
    await expect(wanted).rejects.toMatchObject({ code: 'network' });
  });

  test.each([
    [404, 'not-found'],
    [410, 'not-found'],
    [403, 'network'],
  ])('%i is final: %s', async (status, code) => {
    const { queue, calls } = setUp();
    const wanted = queue.get('http://x/0');
    calls[0].answer(status);
    await expect(wanted).rejects.toBeInstanceOf(FarfieldError);
    await expect(wanted).rejects.toMatchObject({ code });
    expect(calls).toHaveLength(1);
  });

  test('the waiting time doubles up to half a minute', () => {
    for (let attempt = 0; attempt < 12; attempt++) {
      const most = Math.min(30_000, 500 * 2 ** attempt);
      const wait = defaultBackoff(attempt);
      expect(wait).toBeGreaterThanOrEqual(most / 2);
      expect(wait).toBeLessThanOrEqual(most);
    }
  });
});
