import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { Fade, Trial } from '../../src/index.js';

describe('Fade', () => {
  test('something is whole at every moment, whatever happens when', () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(fc.boolean(), fc.double({ min: 0, max: 1, noNaN: true })), {
          maxLength: 30,
        }),
        (steps) => {
          const fade = new Fade();
          let now = 0;
          for (const [picture, seconds] of steps) {
            if (picture) fade.toPicture(now);
            else fade.toObject(now);
            for (let n = 0; n <= 10; n++) {
              const weights = fade.weights(now + (n / 10) * seconds, 0.4);
              expect(weights.object || weights.picture === 1 || weights.old === 1).toBe(true);
              for (const weight of [weights.old, weights.picture]) {
                expect(weight).toBeGreaterThanOrEqual(0);
                expect(weight).toBeLessThanOrEqual(1);
              }
            }
            now += seconds;
          }
        },
      ),
    );
  });

  test('from object to picture to a new picture and back', () => {
    const fade = new Fade();
    expect(fade.weights(0, 1)).toEqual({ object: true, old: 0, picture: 0 });
    fade.toPicture(0);
    expect(fade.weights(0.25, 1)).toEqual({ object: true, old: 0, picture: 0.5 });
    expect(fade.weights(0.75, 1)).toEqual({ object: false, old: 0, picture: 1 });
    fade.toPicture(2);
    expect(fade.weights(2.25, 1)).toEqual({ object: false, old: 1, picture: 0.5 });
    expect(fade.weights(2.75, 1)).toEqual({ object: false, old: 0.5, picture: 1 });
    expect(fade.done(2.75, 1)).toBe(false);
    expect(fade.weights(3, 1)).toEqual({ object: false, old: 0, picture: 1 });
    expect(fade.done(3, 1)).toBe(true);
    fade.toObject(4);
    expect(fade.weights(4.25, 1)).toEqual({ object: true, old: 0, picture: 0.75 });
    expect(fade.weights(6, 1)).toEqual({ object: true, old: 0, picture: 0 });
  });

  test('without a fade it happens at once', () => {
    const fade = new Fade();
    fade.toPicture(1);
    expect(fade.weights(1, 0)).toEqual({ object: false, old: 0, picture: 1 });
    fade.toObject(2);
    expect(fade.weights(2, 0)).toEqual({ object: true, old: 0, picture: 0 });
  });
});

describe('Trial', () => {
  /** Run a trial to its decision; returns the frames it took. */
  function decide(trial: Trial, without: number, withThem: number): number {
    let frames = 0;
    for (; frames < 200; frames++) trial.frame(trial.way === 1 ? withThem : without, 0);
    return frames;
  }

  test('keeps impostors where they make frames shorter, and only there', () => {
    const outcome = (without: number, withThem: number): boolean => {
      const trial = new Trial();
      decide(trial, without, withThem);
      return trial.way === 1;
    };
    expect(outcome(0.05, 0.02)).toBe(true);
    expect(outcome(0.05, 0.049)).toBe(false);
    expect(outcome(0.05, 0.08)).toBe(false);
    expect(outcome(0.016, 0.001)).toBe(false); // fast enough without
  });

  test('of several ways takes the fastest', () => {
    const outcome = (...times: number[]): number => {
      const trial = new Trial({ ways: times.length });
      for (let n = 0; n < 300; n++) trial.frame(times[trial.way], 0);
      return trial.way;
    };
    expect(outcome(0.05, 0.03, 0.02)).toBe(2);
    expect(outcome(0.05, 0.02, 0.03)).toBe(1);
    expect(outcome(0.05, 0.08, 0.049)).toBe(0);
    expect(outcome(0.05, 0.08, 0.04)).toBe(2);
  });

  test('single slow frames change nothing', () => {
    const trial = new Trial();
    for (let n = 0; n < 200; n++) trial.frame(n % 7 === 0 ? 1 : trial.way === 1 ? 0.02 : 0.05, 0);
    expect(trial.way).toBe(1);
  });

  test('tries again after a while, and when told to', () => {
    const trial = new Trial({ every: 10 });
    decide(trial, 0.05, 0.02);
    expect(trial.way).toBe(1);
    trial.frame(0.02, 11);
    expect(trial.way).toBe(0);
    decide(trial, 0.05, 0.06);
    expect(trial.way).toBe(0);
    trial.restart();
    decide(trial, 0.05, 0.02);
    expect(trial.way).toBe(1);
  });
});
