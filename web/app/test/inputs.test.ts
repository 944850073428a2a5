import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { modelUrl } from '../src/walk/comparison.js';
import { readPads } from '../src/walk/gamepad.js';
import { RATE, Recorder, parsePath, poseAt } from '../src/walk/path.js';

describe('gamepads', () => {
  const pad = (axes: number[], pressed: number[] = []) => ({
    mapping: 'standard' as const,
    axes,
    buttons: Array.from({ length: 12 }, (_, n) => ({ pressed: pressed.includes(n), value: 0 })),
  });

  test('sticks walk and look, and rest near the middle', () => {
    expect(readPads([null])).toBeUndefined();
    const resting = readPads([null, pad([0.1, -0.1, 0.14, 0])]);
    for (const axis of ['right', 'forward', 'yaw', 'pitch'] as const) {
      expect(resting?.[axis]).toBeCloseTo(0, 9);
    }
    expect(readPads([pad([1, -1, 1, -1], [3])])).toEqual({
      right: 1,
      forward: 1,
      up: 0,
      yaw: -1,
      pitch: 1,
      fast: false,
      fly: true,
    });
  });
});

describe('paths', () => {
  const file = (poses: number[][]) =>
    parsePath(JSON.stringify({ format: 'farfield-path', version: 1, rate: 30, poses }));

  test('go from pose to pose, turn the short way, and are held at both ends', () => {
    const path = file([
      [0, 1, 2, 3, 0],
      [2, 1, 2, -3, 0.5],
    ]);
    const middle = poseAt(path, 0.5);
    expect(middle.eye).toEqual([1, 1, 2]);
    expect(middle.pitch).toBeCloseTo(0.25);
    expect(Math.abs(Math.cos(middle.yaw) + 1)).toBeLessThan(1e-9);
    expect(poseAt(path, -1)).toEqual(poseAt(path, 0));
    expect(poseAt(path, 99)).toEqual(poseAt(path, 1));
    expect(poseAt(file([[1, 2, 3, 0, 0]]), 5).eye).toEqual([1, 2, 3]);
  });

  test('a recording has one pose for each tick, however frames fall', () => {
    fc.assert(
      fc.property(fc.array(fc.double({ min: 0.001, max: 0.1, noNaN: true })), (frames) => {
        const recorder = new Recorder();
        for (const seconds of frames) {
          recorder.step(seconds, { eye: [1, 2, 3], yaw: 0.5, pitch: 0 });
        }
        const whole = frames.reduce((sum, seconds) => sum + seconds, 0) * RATE;
        expect(Math.abs(recorder.file.poses.length - whole)).toBeLessThanOrEqual(1);
      }),
    );
  });

  test.each(['[]', '{"format": "farfield-path", "version": 2}', 'null', '{'])(
    '%s is no path',
    (text) => {
      expect(() => parsePath(text)).toThrow(/can't be played/);
    },
  );
});

test('the full model lies at the API, or two folders up in a store', () => {
  expect(modelUrl('http://h/api/v1/walks/b/walk.json', 's')).toBe(
    'http://h/api/v1/scenes/s/prepared/',
  );
  expect(modelUrl('https://h/x/bakes/b/walk.json', 's')).toBe('https://h/x/scenes/s/prepared/');
});
