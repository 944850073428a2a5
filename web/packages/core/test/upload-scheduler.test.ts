import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { AbortedError, UploadScheduler, strips, type UploadStep } from '../src/index.js';

const steps = (name: string, sizes: readonly number[], log: string[]): UploadStep[] =>
  sizes.map((bytes, n) => ({ bytes, run: () => log.push(`${name}${n}`) }));

describe('UploadScheduler', () => {
  test('runs every step once, in order, within the budget of each frame', async () => {
    await fc.assert(
      fc.asyncProperty(
        fc.array(fc.array(fc.integer({ min: 1, max: 150 }), { maxLength: 6 }), { maxLength: 5 }),
        async (uploads) => {
          const scheduler = new UploadScheduler();
          const log: string[] = [];
          const done = uploads.map((sizes, n) =>
            scheduler.add(steps(`${n}:`, sizes, log), () => n),
          );
          let before = 0;
          for (let frame = 0; scheduler.pending > 0; frame++) {
            expect(frame).toBeLessThan(100);
            const spent = scheduler.frame(100);
            const ran = log.length - before;
            before = log.length;
            // Only a step that is too large by itself may exceed the budget, and then alone.
            if (spent > 100) expect(ran).toBe(1);
          }
          await Promise.all(done);
          const wanted = uploads.flatMap((sizes, n) => sizes.map((_, m) => `${n}:${m}`));
          expect(log).toEqual(wanted);
        },
      ),
    );
  });

  test('asks for priorities every frame', () => {
    const scheduler = new UploadScheduler();
    const log: string[] = [];
    let urgent = 'a';
    void scheduler.add(steps('a', [60, 60], log), () => (urgent === 'a' ? 0 : 1));
    void scheduler.add(steps('b', [60, 60], log), () => (urgent === 'b' ? 0 : 1));
    scheduler.frame(100);
    urgent = 'b';
    scheduler.frame(100);
    scheduler.frame(100);
    expect(log).toEqual(['a0', 'b0', 'b1']);
  });

  test('an upload that is called off runs no further step', async () => {
    const scheduler = new UploadScheduler();
    const log: string[] = [];
    const abort = new AbortController();
    const done = scheduler.add(steps('a', [60, 60], log), undefined, abort.signal);
    scheduler.frame(100);
    abort.abort();
    scheduler.frame(100);
    await expect(done).rejects.toBeInstanceOf(AbortedError);
    expect(log).toEqual(['a0']);
    expect(scheduler.pending).toBe(0);
  });

  test('a step that throws fails its upload alone', async () => {
    const scheduler = new UploadScheduler();
    const log: string[] = [];
    const broken: UploadStep = {
      bytes: 1,
      run: () => {
        throw new Error('no context');
      },
    };
    const bad = scheduler.add([broken]);
    const good = scheduler.add(steps('g', [1], log));
    scheduler.frame(100);
    await expect(bad).rejects.toThrow('no context');
    await good;
    expect(log).toEqual(['g0']);
  });
});

describe('strips', () => {
  test('cover all rows once, none larger than allowed unless it is one row', () => {
    fc.assert(
      fc.property(
        fc.integer({ min: 1, max: 300 }),
        fc.integer({ min: 1, max: 20000 }),
        fc.integer({ min: 1, max: 1_000_000 }),
        (rows, rowBytes, most) => {
          const parts = strips(rows, rowBytes, most);
          expect(parts[0][0]).toBe(0);
          expect(parts[parts.length - 1][1]).toBe(rows);
          for (const [n, [first, end]] of parts.entries()) {
            if (n > 0) expect(first).toBe(parts[n - 1][1]);
            expect(end).toBeGreaterThan(first);
            expect((end - first) * rowBytes <= most || end - first === 1).toBe(true);
          }
        },
      ),
    );
  });
});
