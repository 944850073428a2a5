import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  FarfieldError,
  backToFront,
  objectLayers,
  parseObject,
  switchDistance,
  type ObjectFile,
} from '../../src/index.js';

const FILE: ObjectFile = {
  format: 'farfield-object',
  version: 1,
  name: 'stone',
  low: [-1, -1, -1],
  high: [1, 1, 1],
  axes: [1, 2, 0],
  resolution: 128,
  textures: 2,
  image: 'object.png',
  triangles: 5120,
  error: 0.05,
};

describe('backToFront', () => {
  test('is the order that a comparing sort finds, up to a step of distance', () => {
    const coordinate = fc.double({ min: -1000, max: 1000, noNaN: true });
    const place = fc.tuple(coordinate, coordinate, coordinate);
    fc.assert(
      fc.property(fc.array(place, { maxLength: 80 }), place, (places, eye) => {
        const order = backToFront(Float32Array.from(places.flatMap((at) => [...at, 1])), eye);
        expect([...order].sort((a, b) => a - b)).toEqual(places.map((_, n) => n));
        const away = places.map((at) => Math.hypot(...at.map((x, axis) => x - eye[axis])));
        const sorted = [...away].sort((a, b) => b - a);
        const step = (Math.max(0, ...away) - Math.min(...away, Infinity)) / 65000;
        order.forEach((n, rank) => {
          expect(Math.abs(away[n] - sorted[rank])).toBeLessThanOrEqual(step + 1e-3);
        });
      }),
    );
  });
});

describe('object.json', () => {
  test('is read as it was written', () => {
    expect(parseObject(JSON.stringify(FILE))).toEqual(FILE);
    expect(objectLayers(FILE)).toBe(18);
  });

  test.each([
    ['not JSON', 'not JSON'],
    [JSON.stringify({ ...FILE, version: 2 }), 'version'],
    [JSON.stringify({ ...FILE, axes: [0, 0, 1] }), 'contradicts'],
    [JSON.stringify({ ...FILE, high: [1, -1, 1] }), 'contradicts'],
    [JSON.stringify({ ...FILE, resolution: 0 }), 'contradicts'],
    [JSON.stringify({ ...FILE, resolution: 1e6 }), 'contradicts'],
    [JSON.stringify({ ...FILE, textures: 9 }), 'contradicts'],
    [JSON.stringify({ ...FILE, image: '../elsewhere.png' }), 'contradicts'],
    [JSON.stringify({ ...FILE, error: null }), 'contradicts'],
    [JSON.stringify({ format: 'farfield-object', version: 1 }), 'contradicts'],
    ['null', 'version'],
  ])('is refused in a sentence: %s', (text, says) => {
    expect(() => parseObject(text)).toThrow(FarfieldError);
    expect(() => parseObject(text)).toThrow(says);
  });

  test('at the switching distance the error is one pixel, and a texel no bigger', () => {
    const away = switchDistance(FILE, 443);
    expect((443 * FILE.error) / away).toBeCloseTo(1, 12);
    expect(switchDistance({ ...FILE, error: 0 }, 443)).toBeCloseTo((443 * 2) / 128, 9);
    expect(switchDistance(FILE, 443, 3, 2)).toBeCloseTo(1.5 * away, 9);
  });
});
