import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  LIMITS,
  boxCorners,
  PictureBudget,
  chooseNext,
  facingBasis,
  frameBox,
  framePixels,
  judge,
  nearAndFar,
  padFrame,
  parallax,
  slotSize,
  vectors,
  viewAngle,
  type Bounds,
  type Frame,
  type Picture,
  type Vec3,
} from '../../src/index.js';
import { vec3 } from '../random.js';

const { add, angleBetween, distance, dot, length, scale, subtract } = vectors;

const BOX: Bounds = { min: [-1, 0, -1], max: [1, 3, 1] };
const MIDDLE: Vec3 = [0, 1.5, 0];
const FOCAL = 443;

function frameFrom(eye: Vec3, box = BOX): Frame {
  const towards = subtract(MIDDLE, eye);
  const camera = { right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1] } as const;
  const basis = facingBasis('spherical', 'camera', camera, towards);
  const frame = frameBox(boxCorners(box), eye, basis, 0.1);
  if (frame === undefined) throw new Error('The eye is too near.');
  return frame;
}

function samples({ min, max }: Bounds, count = 7): Vec3[] {
  const at = (axis: 0 | 1 | 2, n: number): number =>
    min[axis] + ((max[axis] - min[axis]) * n) / (count - 1);
  return Array.from({ length: count ** 3 }, (_, n): Vec3 => [
    at(0, n % count),
    at(1, Math.floor(n / count) % count),
    at(2, Math.floor(n / count ** 2)),
  ]);
}

/** Eyes 10 to 60 m away. */
const eyes = fc
  .tuple(vec3(1), fc.double({ min: 10, max: 60, noNaN: true }))
  .filter(([direction]) => length(direction) > 0.1)
  .map(([direction, away]) => add(MIDDLE, scale(direction, away / length(direction))));

describe('nearAndFar', () => {
  test('are the nearest and the farthest of all points of the box', () => {
    fc.assert(
      fc.property(vec3(8), (eye) => {
        const [near, far] = nearAndFar(BOX, eye).map((point) => distance(point, eye));
        const all = samples(BOX).map((point) => distance(point, eye));
        expect(near).toBeLessThanOrEqual(Math.min(...all) + 1e-9);
        expect(far).toBeCloseTo(Math.max(...all), 9);
      }),
    );
  });
});

describe('viewAngle', () => {
  test('no point of the box turns by more than the bound at the near point; the far one is tested', () => {
    fc.assert(
      fc.property(eyes, vec3(0.5), (before, step) => {
        const now = add(before, step);
        const turned = samples(BOX).map((point) =>
          angleBetween(subtract(before, point), subtract(now, point)),
        );
        // A small step turns a point by at most step / distance, and the near point is nearest.
        const [near] = nearAndFar(BOX, now);
        const bound = length(step) / (distance(near, now) - length(step)) + 1e-9;
        expect(Math.max(...turned)).toBeLessThanOrEqual(bound);
        expect(viewAngle(BOX, before, now)).toBeLessThanOrEqual(bound);
        // The farthest point is among the samples, maybe with others as far as it.
        const away = samples(BOX).map((point) => distance(point, now));
        const most = Math.max(...away) - 1e-9;
        const farthest = Math.min(...turned.filter((_, n) => away[n] >= most));
        expect(viewAngle(BOX, before, now)).toBeGreaterThanOrEqual(farthest - 1e-9);
      }),
    );
  });

  test('coming nearer along the line of sight turns the far corner, though not the centre', () => {
    const [before, now]: Vec3[] = [
      [0, 1.5, 20],
      [0, 1.5, 5],
    ];
    const centre = angleBetween(subtract(before, MIDDLE), subtract(now, MIDDLE));
    expect(centre).toBeCloseTo(0, 9);
    expect(viewAngle(BOX, before, now)).toBeGreaterThan(0.1);
  });

  test('is everything from within', () => {
    expect(viewAngle(BOX, [0, 1.5, 9], [0, 1, 0])).toBe(Math.PI);
  });
});

describe('parallax', () => {
  test('is nothing where the picture was taken', () => {
    fc.assert(
      fc.property(eyes, (eye) => {
        expect(parallax(BOX, frameFrom(eye), eye)).toBeLessThan(1e-7);
      }),
    );
  });

  test('bounds what any point of the box is moved by on the screen', () => {
    fc.assert(
      fc.property(eyes, vec3(1), (before, step) => {
        const frame = frameFrom(before);
        const now = add(before, step);
        const most = Math.max(
          ...samples(BOX).map((point) => {
            const ray = subtract(point, before);
            const shown = add(before, scale(ray, frame.near / dot(ray, frame.basis.forward)));
            return angleBetween(subtract(shown, now), subtract(point, now));
          }),
        );
        expect(most).toBeLessThanOrEqual(1.05 * parallax(BOX, frame, now) + 1e-7);
      }),
    );
  });
});

describe('judge', () => {
  const pictureFrom = (eye: Vec3, taken = 0): Picture => {
    const frame = frameFrom(eye);
    const size = slotSize(framePixels(frame, FOCAL));
    if (size === undefined) throw new Error('The eye is too near.');
    return { frame: padFrame(frame, size, 1), size, taken };
  };
  const look = (eye: Vec3, now = 0) => ({
    eye,
    now,
    focal: FOCAL,
    pixels: framePixels(frameFrom(eye), FOCAL),
  });

  test('a new picture is fresh, from anywhere', () => {
    fc.assert(
      fc.property(eyes, (eye) => {
        expect(judge(BOX, pictureFrom(eye), look(eye), LIMITS)).toBe('fresh');
      }),
    );
  });

  test('what is fresh is right within a pixel, whatever step was taken', () => {
    fc.assert(
      fc.property(eyes, vec3(3), (before, step) => {
        const now = add(before, step);
        const frame = frameFrom(before);
        fc.pre(distance(now, MIDDLE) > 5);
        if (judge(BOX, pictureFrom(before), look(now), LIMITS) !== 'fresh') return;
        for (const point of samples(BOX)) {
          const ray = subtract(point, before);
          const shown = add(before, scale(ray, frame.near / dot(ray, frame.basis.forward)));
          const off = angleBetween(subtract(shown, now), subtract(point, now));
          expect(FOCAL * off).toBeLessThan(1.05);
        }
      }),
    );
  });

  test('walking around it, it becomes stale and then expires', () => {
    const picture = pictureFrom([0, 1.5, 20]);
    const states = Array.from({ length: 80 }, (_, n) => {
      const angle = n / 80;
      return judge(BOX, picture, look([20 * Math.sin(angle), 1.5, 20 * Math.cos(angle)]), LIMITS);
    });
    expect([...new Set(states)]).toEqual(['fresh', 'stale', 'expired']);
  });

  test('coming near it expires as soon as a texel is bigger than a pixel', () => {
    const picture = pictureFrom([0, 1.5, 20]);
    const loose = { ...LIMITS, angle: 10, pixels: 1000 };
    for (let z = 20; z > 5; z -= 0.1) {
      const now = look([0, 1.5, z]);
      const state = judge(BOX, picture, now, loose);
      expect(state === 'expired').toBe(now.pixels > 1.05 * (picture.size - 2));
    }
  });

  test('going away it asks for a smaller slot, and then has peace there', () => {
    const picture = pictureFrom([0, 1.5, 8]);
    const loose = { ...LIMITS, angle: 10, pixels: 1000 };
    const state = judge(BOX, picture, look([0, 1.5, 60]), loose);
    expect(state).toBe('stale');
    const smaller = pictureFrom([0, 1.5, 60]);
    expect(smaller.size).toBeLessThan(picture.size);
    expect(judge(BOX, smaller, look([0, 1.5, 60]), loose)).toBe('fresh');
  });

  test('grows old only where it has an age', () => {
    const picture = pictureFrom([0, 1.5, 20]);
    const at = (age: number, limit: number) =>
      judge(BOX, picture, look([0, 1.5, 20], age), { ...LIMITS, age: limit });
    expect([at(1e9, Infinity), at(0.1, 0.2), at(0.3, 0.2), at(0.7, 0.2)]).toEqual([
      'fresh',
      'fresh',
      'stale',
      'expired',
    ]);
  });
});

describe('chooseNext', () => {
  test('takes the nearest first, of equally near ones the oldest, of equally old ones the expired', () => {
    const near = { distance: 5, waited: 0, expired: false, cost: 1 };
    const far = { distance: 50, waited: 0, expired: false, cost: 1 };
    const old = { distance: 50, waited: 5, expired: false, cost: 1 };
    const gone = { distance: 50, waited: 0, expired: true, cost: 1 };
    expect(chooseNext([far, old, near], 2)).toEqual([near, old]);
    expect(chooseNext([far, gone], 1)).toEqual([gone]);
    expect(chooseNext([far, gone], 0)).toEqual([]);
    expect(chooseNext([far], 0)).toEqual([]);
  });

  test('stops once the budget is spent, but takes one whatever it costs', () => {
    const of = (cost: number) => ({ distance: 5, waited: 0, expired: false, cost });
    const all = [of(4), of(3), of(2)];
    const counts = [0, 4, 5, 7, 8].map((budget) => chooseNext(all, 8, budget).length);
    expect(counts).toEqual([1, 1, 2, 2, 3]);
  });

  test('nothing waits for ever', () => {
    fc.assert(
      fc.property(
        fc.array(fc.double({ min: 1, max: 100, noNaN: true }), { minLength: 1, maxLength: 60 }),
        fc.integer({ min: 1, max: 6 }),
        (distances, most) => {
          const all = distances.map((away) => ({
            distance: away,
            waited: 0,
            expired: false,
            cost: 1,
          }));
          const longest = all.map(() => 0);
          for (let frame = 0; frame < 3000; frame++) {
            const chosen = new Set(chooseNext(all, most));
            expect(chosen.size).toBe(Math.min(most, all.length));
            all.forEach((one, n) => {
              one.waited = chosen.has(one) ? 0 : one.waited + 1;
              longest[n] = Math.max(longest[n], one.waited);
            });
          }
          // Weights of 1 to 100, at most 60 of them: a turn comes within 100 rounds.
          expect(Math.max(...longest)).toBeLessThanOrEqual((100 * distances.length) / most);
        },
      ),
      { numRuns: 20 },
    );
  });
});

describe('PictureBudget', () => {
  const waiting = Array.from({ length: 12 }, () => ({
    distance: 5,
    waited: 1,
    expired: false,
    cost: 1000,
  }));

  test('spreads what is due over frames, and spends no more than its time', () => {
    const budget = new PictureBudget(4);
    expect(budget.allowance(waiting)).toBe(0);
    budget.spent(1000, 0.1);
    expect(budget.allowance(waiting)).toBe(4000);
    for (let n = 0; n < 100; n++) budget.spent(1000, 2); // 2 ms for one
    expect(budget.allowance(waiting)).toBe(2000);
    budget.spent(0, 5);
    expect(budget.allowance(waiting)).toBe(2000);
  });

  test('learns what pictures cost', () => {
    const budget = new PictureBudget(4);
    budget.spent(1000, 100); // the first one compiles programs
    budget.spent(1000, 0.5);
    expect(budget.allowance(waiting)).toBe(4000);
    budget.spent(1000, 100); // and one waited for something else
    expect(budget.allowance(waiting)).toBe(4000);
    for (let n = 0; n < 100; n++) budget.spent(1000, 2);
    expect(budget.allowance(waiting)).toBe(2000);
  });

  test('objects that grow stale together become fresh within a few frames', () => {
    const all = waiting.map((one) => ({ ...one, waited: 0 }));
    const budget = new PictureBudget(1000);
    budget.spent(1, 1e-3);
    const taken: number[] = [];
    let left = all;
    while (left.length > 0) {
      const chosen = chooseNext(left, 8, budget.allowance(left));
      taken.push(chosen.length);
      left = left.filter((one) => !chosen.includes(one));
    }
    expect(taken).toEqual([4, 3, 2, 1, 1, 1]);
  });
});
