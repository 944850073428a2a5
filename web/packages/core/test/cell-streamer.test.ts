import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  AbortedError,
  CellIndex,
  CellStreamer,
  FarfieldError,
  type Job,
  type Loaded,
  type Motion,
  type Vec3,
} from '../src/index.js';

interface View {
  readonly name: string;
  disposed: boolean;
}

interface Load {
  readonly job: Job;
  readonly view: View;
  settled: boolean;
  finish: (bytes?: number) => void;
  fail: (error: Error) => void;
}

function setUp(options: { capacity?: number; prefetch?: number; columns?: number } = {}) {
  const columns = options.columns ?? 8;
  const index = new CellIndex({
    origin: [0, 0, 0],
    size: [10, 4, 10],
    total: columns * columns,
    cells: {
      i: Array.from({ length: columns * columns }, (_, n) => n % columns),
      j: Array<number>(columns * columns).fill(0),
      k: Array.from({ length: columns * columns }, (_, n) => Math.floor(n / columns)),
      y: Array<number>(columns * columns).fill(0),
    },
  });
  const loads: Load[] = [];
  const views: View[] = [];
  const errors: [string, string][] = [];
  const clock = { now: 0 };
  const streamer = new CellStreamer<View>({
    index,
    capacity: options.capacity ?? 1000,
    prefetch: options.prefetch ?? 5,
    now: () => clock.now,
    onError: (cell, error) => errors.push([cell.name, error.message]),
    dispose: (view) => {
      expect(view.disposed).toBe(false);
      view.disposed = true;
    },
    load: (job) =>
      new Promise<Loaded<View>>((resolve, reject) => {
        const view = { name: job.cell.name, disposed: false };
        job.signal.addEventListener('abort', () => reject(new AbortedError()));
        const load: Load = {
          job,
          view,
          settled: false,
          finish: (bytes = 10) => {
            load.settled = true;
            views.push(view);
            resolve({ view, bytes });
          },
          fail: (error) => {
            load.settled = true;
            reject(error);
          },
        };
        loads.push(load);
      }),
  });
  const look = (eye: Vec3, velocity: Vec3 = [0, 0, 0]): Motion => ({
    eye,
    velocity,
    view: [1, 0, 0],
  });
  const open = (): Load[] => loads.filter(({ job, settled }) => !job.signal.aborted && !settled);
  const tick = (): Promise<void> => new Promise((resolve) => setImmediate(resolve));
  return { streamer, loads, views, errors, clock, look, open, tick };
}

const HERE: Vec3 = [45, 2, 45];

describe('CellStreamer', () => {
  test('loads the walker’s own cell first, then neighbours, a few at once', async () => {
    const { streamer, loads, look, tick } = setUp();
    expect(streamer.update(look(HERE))).toBeUndefined();
    streamer.update(look(HERE));
    expect(loads.map(({ job }) => job.cell.name)).toEqual(['4_0_4']);
    expect(loads[0].job.priority()).toBe(0);
    loads[0].finish();
    await tick();
    expect(streamer.update(look(HERE))?.name).toBe('4_0_4');
    expect(streamer.settled).toBe(true);
    expect(loads.slice(1).map(({ job }) => job.cell.name)).toEqual(['5_0_4', expect.any(String)]);
    expect(loads[1].job.priority()).toBe(1);
  });

  test('shows only complete cells, stays under its cap, disposes of everything once', async () => {
    await fc.assert(
      fc.asyncProperty(
        fc.array(
          fc.record({
            x: fc.integer({ min: -12, max: 12 }),
            z: fc.integer({ min: -12, max: 12 }),
            finish: fc.nat(3),
            fails: fc.boolean(),
            bytes: fc.integer({ min: 1, max: 40 }),
          }),
          { minLength: 1, maxLength: 40 },
        ),
        async (steps) => {
          const { streamer, views, look, open, tick, clock } = setUp({ capacity: 100 });
          let eye: Vec3 = HERE;
          let shownBefore = false;
          for (const { x, z, finish, fails, bytes } of steps) {
            clock.now += 5000;
            eye = [Math.min(79, Math.max(1, eye[0] + x)), 2, Math.min(79, Math.max(1, eye[2] + z))];
            const view = streamer.update(look(eye, [x, 0, z]));
            if (view !== undefined) {
              expect(views).toContain(view);
              expect(view.disposed).toBe(false);
              expect(view.name).toBe(streamer.shown?.name);
            }
            // Once something is shown, something always is.
            expect(shownBefore && view === undefined).toBe(false);
            shownBefore = view !== undefined;
            expect(streamer.bytes).toBeLessThanOrEqual(100);
            for (const load of open().slice(0, finish)) {
              if (fails) load.fail(new FarfieldError('network', 'broken'));
              else load.finish(bytes);
            }
            await tick();
          }
          streamer.dispose();
          await tick();
          expect(views.every(({ disposed }) => disposed)).toBe(true);
          expect(streamer.bytes).toBe(0);
        },
      ),
      { numRuns: 60 },
    );
  });

  test('keeps showing the old cell until the new one is complete', async () => {
    const { streamer, look, open, tick } = setUp();
    streamer.update(look(HERE));
    open()[0].finish();
    await tick();
    streamer.update(look(HERE));
    expect(streamer.update(look([51, 2, 45]))?.name).toBe('4_0_4');
    expect(streamer.settled).toBe(false);
    open()
      .find(({ job }) => job.cell.name === '5_0_4')
      ?.finish();
    await tick();
    expect(streamer.update(look([51, 2, 45]))?.name).toBe('5_0_4');
  });

  test('calls off what is no longer near', () => {
    const { streamer, loads, look } = setUp();
    streamer.update(look([5, 2, 5]));
    streamer.update(look([75, 2, 75]));
    expect(loads[0].job.signal.aborted).toBe(true);
    expect(loads[1].job.cell.name).toBe('7_0_7');
  });

  test('a cell that is not baked yet is asked for again, later and later', async () => {
    const { streamer, loads, look, errors, clock, tick } = setUp({ prefetch: 1 });
    const asked: number[] = [];
    for (let second = 0; second < 30; second++) {
      clock.now = 1000 * second;
      const before = loads.length;
      streamer.update(look(HERE));
      if (loads.length > before) {
        asked.push(second);
        loads[loads.length - 1].fail(new FarfieldError('not-found', 'nothing there'));
        await tick();
        expect(streamer.state('4_0_4')).toBe('absent');
      }
    }
    expect(asked.slice(0, 4)).toEqual([0, 2, 5, 9]);
    expect(errors).toHaveLength(asked.length);
    streamer.retry();
    streamer.update(look(HERE));
    expect(loads).toHaveLength(asked.length + 1);
  });

  test('neighbours are loaded while the own cell is not baked', async () => {
    const { streamer, loads, look, tick } = setUp();
    streamer.update(look(HERE));
    loads[0].fail(new FarfieldError('not-found', 'nothing there'));
    await tick();
    streamer.update(look(HERE));
    loads[1].finish();
    await tick();
    expect(streamer.update(look(HERE))?.name).toBe(loads[1].job.cell.name);
  });

  test('room for the own cell is made by giving up what matters less', async () => {
    const { streamer, look, open, tick, views } = setUp({ capacity: 30 });
    streamer.update(look(HERE));
    for (let n = 0; n < 6; n++) {
      open().forEach((load) => load.finish(10));
      await tick();
      streamer.update(look(HERE));
    }
    expect(streamer.bytes).toBe(30);
    const far = look([75, 2, 75]);
    streamer.update(far);
    open().forEach((load) => load.finish(15));
    await tick();
    expect(streamer.update(far)?.name).toBe('7_0_7');
    expect(streamer.bytes).toBeLessThanOrEqual(30);
    expect(views.filter(({ disposed }) => disposed).length).toBeGreaterThan(0);
  });

  test('a neighbour that does not fit ends the prefetch, not the walk', async () => {
    const { streamer, loads, look, open, tick, errors } = setUp({ capacity: 10 });
    streamer.update(look(HERE));
    open()[0].finish(10);
    await tick();
    streamer.update(look(HERE));
    open().forEach((load) => load.finish(10));
    await tick();
    const before = loads.length;
    for (let n = 0; n < 5; n++) streamer.update(look(HERE));
    expect(loads).toHaveLength(before);
    expect(errors).toEqual([]);
    expect(streamer.settled).toBe(true);
  });

  test('the own cell takes the shown one’s memory when nothing else is left to give', async () => {
    const { streamer, look, open, tick, views } = setUp({ capacity: 10 });
    streamer.update(look(HERE));
    open()[0].finish(10);
    await tick();
    expect(streamer.update(look(HERE))?.name).toBe('4_0_4');
    const beyond = look([55, 2, 45]);
    streamer.update(beyond);
    open().forEach((load) => load.finish(10));
    await tick();
    // Never both, and never stuck with the cell that was left behind.
    expect(streamer.update(beyond)?.name).toBe('5_0_4');
    expect(streamer.bytes).toBe(10);
    expect(views[0].disposed).toBe(true);
  });

  test('pages that a load is short of come from the shown cell only for the own cell', async () => {
    const { streamer, look, open, tick, views } = setUp({ prefetch: 2 });
    streamer.update(look(HERE));
    open()[0].finish();
    await tick();
    streamer.update(look(HERE));
    expect(open().map(({ job }) => job.priority())).toEqual([1]);
    // A neighbour short of memory gets nothing from what is seen.
    expect(streamer.evict(1)).toBe(false);
    const beyond = look([75, 2, 75]);
    streamer.update(beyond);
    expect(streamer.shown?.name).toBe('4_0_4');
    expect(streamer.evict(0)).toBe(true);
    expect(views[0].disposed).toBe(true);
    expect(streamer.shown).toBeUndefined();
    expect(streamer.evict(0)).toBe(false);
    open()[0].finish();
    await tick();
    expect(streamer.update(beyond)?.name).toBe('7_0_7');
  });

  test('loads give way to what matters more, the last in the order first', async () => {
    const { streamer, loads, look, open, tick } = setUp();
    streamer.update(look(HERE));
    // The own cell gives way to nothing.
    expect(streamer.evict(0)).toBe(false);
    open()[0].finish();
    await tick();
    streamer.update(look(HERE));
    expect(open().map(({ job }) => job.priority())).toEqual([1, 2]);
    expect(streamer.evict(1)).toBe(true);
    expect(loads[2].job.signal.aborted).toBe(true);
    expect(streamer.evict(1)).toBe(false);
    expect(streamer.evict(0)).toBe(true);
    expect(loads[1].job.signal.aborted).toBe(true);
    // What was pushed out is not started again at once.
    streamer.update(look(HERE));
    expect(open()).toEqual([]);
  });

  test('after a reset everything is loaded anew', async () => {
    const { streamer, loads, look, tick } = setUp({ prefetch: 1 });
    streamer.update(look(HERE));
    loads[0].finish();
    await tick();
    expect(streamer.update(look(HERE))?.name).toBe('4_0_4');
    streamer.reset();
    expect(loads[0].view.disposed).toBe(true);
    expect(streamer.update(look(HERE))).toBeUndefined();
    loads[1].finish();
    await tick();
    expect(streamer.update(look(HERE))?.name).toBe('4_0_4');
  });
});
