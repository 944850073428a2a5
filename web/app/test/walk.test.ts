import { CellIndex, Solid, buildSolid, type NearBatch, type Vec3 } from '@farfield/core';
import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { readBakes } from '../src/landing/bakes.js';
import {
  formatPose,
  isCapture,
  manifestUrl,
  parsePose,
  textureMemory,
} from '../src/walk/address.js';
import { explain } from '../src/walk/state.js';
import { STILL, Walker, walkingSpeed } from '../src/walk/walker.js';

describe('addresses', () => {
  test.each([
    ['http://h/walk/abc', 'http://h/api/v1/walks/abc/walk.json'],
    ['http://h/walk/abc/', 'http://h/api/v1/walks/abc/walk.json'],
    ['http://h/walk/index.html?walk=../bakes/b/walk.json', 'http://h/bakes/b/walk.json'],
    ['http://h/x/?walk=https://o.org/w.json', 'https://o.org/w.json'],
    ['http://h/walk/index.html', undefined],
    ['http://h/walk/', undefined],
    ['http://h/', undefined],
  ])('%s opens %s', (page, manifest) => {
    expect(manifestUrl(new URL(page))).toBe(manifest);
  });

  test('a place in the corridor survives the address', () => {
    const number = fc.double({ min: -5000, max: 5000, noNaN: true });
    fc.assert(
      fc.property(fc.tuple(number, number, number), number, number, (eye, yaw, pitch) => {
        const back = parsePose(formatPose({ eye, yaw, pitch }));
        expect(back).toBeDefined();
        eye.forEach((value, axis) => expect(back?.eye[axis]).toBeCloseTo(value, 2));
        expect(back?.yaw).toBeCloseTo(yaw, 3);
        expect(back?.pitch).toBeCloseTo(pitch, 3);
      }),
    );
  });

  test.each(['', '#', '#at=', '#at=1,2', '#at=1,2,x', '#at=1,,3', '#at=1,2,3,4,5,6', '#to=1,2,3'])(
    '%s is no place',
    (hash) => {
      expect(parsePose(hash)).toBeUndefined();
    },
  );

  test.each([
    ['?memory=64', 64],
    ['?memory=0.1', undefined],
    ['?memory=lots', undefined],
    ['', undefined],
  ])('%s asks for so much texture memory', (query, megabytes) => {
    expect(textureMemory(new URL(`http://h/walk/a${query}`))).toBe(megabytes);
  });

  test('capture is asked for', () => {
    expect(isCapture(new URL('http://h/walk/a?capture'))).toBe(true);
    expect(isCapture(new URL('http://h/walk/a'))).toBe(false);
  });
});

const corridor = (size: Vec3, lift = 0): CellIndex =>
  new CellIndex({
    origin: [0, 0, 0],
    size,
    total: 4,
    cells: { i: [0, 1, 2, 3], j: [0, 0, 0, 0], k: [0, 0, 0, 0], y: [0, lift, 2 * lift, 3 * lift] },
  });

const walkFor = (
  walker: Walker,
  index: CellIndex,
  seconds: number,
  intent: object,
  brake = 1,
): void => {
  for (let n = 0; n < 60 * seconds; n++) {
    walker.step(1 / 60, { ...STILL, ...intent }, { index, brake: () => brake });
  }
};

describe('Walker', () => {
  const start = (eye: Vec3, yaw = 0): Walker => {
    const walker = new Walker();
    walker.place({ eye, yaw, pitch: 0 });
    return walker;
  };

  test('yaw 0 walks along -z, a quarter left along -x, a quarter right along +x', () => {
    const index = corridor([10, 4, 10]);
    for (const [yaw, x, z] of [
      [0, 0, -1],
      [Math.PI / 2, -1, 0],
      [-Math.PI / 2, 1, 0],
    ] as const) {
      const walker = start([15, 2, 5], yaw);
      walkFor(walker, index, 1, { forward: 1 });
      expect(Math.sign(Math.round(walker.eye[0] - 15))).toBe(x);
      expect(Math.sign(Math.round(walker.eye[2] - 5))).toBe(z);
    }
  });

  test('walks at walking speed, four times as fast in a hurry, and no faster across', () => {
    const index = corridor([100, 4, 100]);
    const distance = (intent: object): number => {
      const walker = start([150, 2, 50]);
      walker.direct = true;
      walkFor(walker, index, 1, intent);
      return Math.hypot(walker.eye[0] - 150, walker.eye[2] - 50);
    };
    expect(distance({ forward: 1 })).toBeCloseTo(walkingSpeed(100), 6);
    expect(distance({ forward: 1, right: 1 })).toBeCloseTo(walkingSpeed(100), 6);
    expect(distance({ forward: 1, fast: true })).toBeCloseTo(4 * walkingSpeed(100), 6);
  });

  test('speed is a person’s where cells are a few metres, in proportion where they are not', () => {
    expect(walkingSpeed(4)).toBeCloseTo(1.4);
    expect(walkingSpeed(14)).toBeGreaterThan(1.4);
    expect(walkingSpeed(14)).toBeLessThan(4);
    expect(walkingSpeed(1)).toBeCloseTo(0.35);
    expect(walkingSpeed(2000)).toBeCloseTo(700);
  });

  test('keeps its height above cells that climb', () => {
    const index = corridor([4, 3, 4], 0.5);
    const walker = start([1, 1.6, 2], -Math.PI / 2);
    walkFor(walker, index, 9, { forward: 1 });
    walkFor(walker, index, 2, {});
    const cell = index.at(walker.eye);
    expect(cell?.name).toBe('3_0_0');
    expect(walker.eye[1] - (cell?.low[1] ?? 0)).toBeCloseTo(1.6, 2);
  });

  test('flies where it looks, and only then', () => {
    const index = corridor([10, 40, 10]);
    for (const flying of [false, true]) {
      const walker = start([15, 2, 9]);
      walker.place({ eye: [15, 2, 9], yaw: 0, pitch: 0.5 });
      walker.flying = flying;
      walkFor(walker, index, 2, { forward: 1 });
      expect(walker.eye[1] > 2.5).toBe(flying);
    }
  });

  test('waits where it is told to', () => {
    const index = corridor([10, 4, 10]);
    const walker = start([15, 2, 5]);
    walkFor(walker, index, 1, { forward: 1 }, 0);
    expect(walker.eye).toEqual([15, 2, 5]);
  });

  test('says when a wall stops it, and looks no further than straight up', () => {
    const index = corridor([10, 4, 10]);
    const walker = start([15, 2, 5]);
    walkFor(walker, index, 5, { forward: 1, pitch: 0.1 });
    expect(walker.blocked).toBe(true);
    expect(walker.eye[2]).toBeGreaterThan(0);
    expect(walker.pitch).toBeLessThan(Math.PI / 2);
  });

  test('someone outside is put into the corridor', () => {
    const index = corridor([10, 4, 10]);
    const walker = start([-100, 50, 200]);
    walker.enter(index);
    expect(index.at(walker.eye)?.name).toBe('0_0_0');
  });
});

describe('Walker on solid ground', () => {
  /** Boxes, by lowest and highest corner, around a cell of 10 x 10 x 10 at the origin. */
  const solidOf = (...boxes: [Vec3, Vec3][]): Solid => {
    const positions: number[] = [];
    const indices: number[] = [];
    for (const [low, high] of boxes) {
      const first = positions.length / 3;
      for (let n = 0; n < 8; n++) {
        positions.push(
          ...[0, 1, 2].map((axis) => ((n >> axis) & 1 ? high[axis] - 5 : low[axis] - 5)),
        );
      }
      for (const [a, b, c, d] of [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
      ]) {
        indices.push(...[a, b, c, a, c, d].map((corner) => first + corner));
      }
    }
    const batch = {
      state: { alpha: 'opaque' },
      positions: Float32Array.from(positions),
      indices: Uint32Array.from(indices),
    } as unknown as NearBatch;
    return new Solid(buildSolid([batch], [5, 5, 5], [10, 10, 10]));
  };
  const floor: [Vec3, Vec3] = [
    [-20, -1, -20],
    [30, 1, 30],
  ];
  const index = new CellIndex({
    origin: [0, 0, 0],
    size: [10, 10, 10],
    total: 1,
    cells: { i: [0], j: [0], k: [0], y: [0] },
  });
  const walk = (walker: Walker, solid: Solid, seconds: number, intent: object): void => {
    for (let n = 0; n < 30 * seconds; n++) {
      walker.step(1 / 30, { ...STILL, ...intent }, { index, brake: () => 1, solid });
    }
  };
  const at = (eye: Vec3, yaw = 0): Walker => {
    const walker = new Walker();
    walker.place({ eye, yaw, pitch: 0 });
    return walker;
  };

  test('lands at eye height, however high the cell’s centre is', () => {
    const walker = at([5, 5, 5]);
    walker.land();
    walk(walker, solidOf(floor), 2, {});
    expect(walker.eye[1]).toBeCloseTo(1 + 1.7, 3);
  });

  test('a place that was asked for keeps its height, and going up keeps the new one', () => {
    const walker = at([5, 4, 5]);
    walk(walker, solidOf(floor), 1, { forward: 0.5 });
    expect(walker.eye[1]).toBeCloseTo(4, 3);
    walk(walker, solidOf(floor), 0.5, { up: 1 });
    const high = walker.eye[1];
    expect(high).toBeGreaterThan(4.5);
    walk(walker, solidOf(floor), 1, { forward: -0.5 });
    expect(walker.eye[1]).toBeCloseTo(high, 1);
  });

  test('ground that comes to be known later pulls nobody down', () => {
    const walker = at([5, 4, 5]);
    for (let n = 0; n < 10; n++) walker.step(1 / 30, STILL, { index, brake: () => 1 });
    walk(walker, solidOf(floor), 2, {});
    expect(walker.eye[1]).toBeCloseTo(4, 6);
    for (let n = 0; n < 10; n++) walker.step(1 / 30, STILL, { index, brake: () => 1 });
    expect(walker.eye[1]).toBeCloseTo(4, 6);
  });

  test('climbs steps, and is stopped by what is higher than a step', () => {
    const step: [Vec3, Vec3] = [
      [-20, 1, -20],
      [30, 1.4, 3],
    ];
    const wall: [Vec3, Vec3] = [
      [-20, 1, -20],
      [30, 3.5, 3],
    ];
    const climber = at([5, 2.7, 6]);
    climber.land();
    walk(climber, solidOf(floor, step), 2.6, { forward: 1 });
    expect(climber.eye[2]).toBeLessThan(2);
    expect(climber.eye[1]).toBeCloseTo(1.4 + 1.7, 2);
    const stopped = at([5, 2.7, 6]);
    stopped.land();
    walk(stopped, solidOf(floor, wall), 4, { forward: 1, fast: true });
    expect(stopped.eye[2]).toBeCloseTo(3.3, 2);
    expect(stopped.eye[1]).toBeCloseTo(2.7, 2);
    // Along the wall it goes on.
    const x = stopped.eye[0];
    walk(stopped, solidOf(floor, wall), 1, { forward: 1, right: 1 });
    expect(stopped.eye[0]).toBeGreaterThan(x + 0.5);
  });

  test('no wall is passed at any speed, from any side', () => {
    fc.assert(
      fc.property(
        fc.double({ min: -Math.PI, max: Math.PI, noNaN: true }),
        fc.double({ min: 0.2, max: 40, noNaN: true }),
        (yaw, pace) => {
          const thin: [Vec3, Vec3] = [
            [-20, 1, 4.99],
            [30, 9, 5.01],
          ];
          const solid = solidOf(floor, thin);
          for (const z of [2.5, 7.5]) {
            const walker = at([5, 2.7, z], yaw);
            walker.land();
            walker.pace = pace;
            walk(walker, solid, 3, { forward: 1, fast: true });
            expect(Math.sign(walker.eye[2] - 5)).toBe(Math.sign(z - 5));
          }
        },
      ),
      { numRuns: 40 },
    );
  });

  test('flies through walls and lands again', () => {
    const wall: [Vec3, Vec3] = [
      [-20, 1, 3],
      [30, 9, 3.2],
    ];
    const solid = solidOf(floor, wall);
    const walker = at([5, 2.7, 5]);
    walker.flying = true;
    walk(walker, solid, 2, { forward: 1 });
    expect(walker.eye[2]).toBeLessThan(3);
    walk(walker, solid, 1, { up: 1 });
    expect(walker.eye[1]).toBeGreaterThan(4);
    walker.flying = false;
    walk(walker, solid, 2, {});
    expect(walker.eye[1]).toBeCloseTo(2.7, 2);
  });

  test('the corridor’s edge is soft: it slows before it stops, and never holds back', () => {
    const walker = at([5, 2.7, 2]);
    walker.direct = true;
    const solid = solidOf(floor);
    const places: number[] = [];
    for (let n = 0; n < 120; n++) {
      walk(walker, solid, 1 / 30, { forward: 1 });
      places.push(walker.eye[2]);
    }
    const steps = places.slice(1).map((z, n) => places[n] - z);
    expect(steps.some((s) => s > 0 && s < 0.5 * steps[0])).toBe(true);
    expect(walker.blocked).toBe(true);
    walk(walker, solid, 0.5, { forward: -1 });
    expect(walker.eye[2]).toBeGreaterThan(0.2 + 0.4 * walkingSpeed(10));
    expect(walker.blocked).toBe(false);
  });

  test('goes no faster than cells arrive', () => {
    const walker = at([5, 2.7, 9]);
    walker.direct = true;
    walker.step(1, { ...STILL, forward: 1, fast: true }, { index, brake: () => 1, topSpeed: 0.5 });
    expect(walker.eye[2]).toBeCloseTo(8.5, 6);
  });
});

describe('words', () => {
  test('the list of bakes is read whatever shape it comes in', () => {
    const bake = { id: 'b', name: 'City', scene: 's', cells: { done: 2, total: 4 } };
    const wanted = [{ id: 'b', name: 'City', scene: 's', progress: '2 of 4 cells' }];
    expect(readBakes([bake])).toEqual(wanted);
    expect(readBakes({ bakes: [bake] })).toEqual(wanted);
    expect(readBakes({ items: [bake, { name: 'no id' }, null, 3] })).toEqual(wanted);
    expect(readBakes([{ id: 'b' }])).toEqual([{ id: 'b', name: 'b', scene: '', progress: '' }]);
    expect(readBakes('nothing')).toEqual([]);
  });

  test('errors have a title, and unknown ones keep their text', () => {
    const error = Object.assign(new Error('No network.'), { code: 'network' });
    expect(explain(error).text).toBe('No network.');
    expect(explain(new Error('Odd.'))).toEqual({ title: 'Something went wrong', text: 'Odd.' });
    expect(explain(Object.assign(new Error(''), { code: 'not-found' })).title).toContain('no walk');
  });
});
