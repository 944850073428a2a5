import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  billboard,
  boxCorners,
  facingBasis,
  frameBox,
  framePixels,
  padFrame,
  vectors,
  type Basis,
  type Bounds,
  type Vec3,
} from '../../src/index.js';
import { vec3 } from '../random.js';

const { add, cross, dot, length, scale, subtract, unit } = vectors;

const CAMERA: Basis = { right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1] };

/** Boxes well in front of a camera that looks along -z. */
const boxes: fc.Arbitrary<Bounds> = fc
  .tuple(vec3(4), fc.tuple(...[0, 1, 2].map(() => fc.double({ min: 0.1, max: 4, noNaN: true }))))
  .map(([at, [x, y, z]]) => {
    const centre = add(at, [0, 0, -30]);
    return { min: subtract(centre, [x, y, z]), max: add(centre, [x, y, z]) };
  });

const kinds = fc.record({
  turning: fc.constantFrom('spherical' as const, 'cylindrical' as const),
  facing: fc.constantFrom('camera' as const, 'camera-plane' as const),
});

/** Points of a regular grid in a box. */
function samples({ min, max }: Bounds, count = 5): Vec3[] {
  const points: Vec3[] = [];
  const at = (axis: 0 | 1 | 2, n: number): number =>
    min[axis] + ((max[axis] - min[axis]) * n) / (count - 1);
  for (let i = 0; i < count; i++)
    for (let j = 0; j < count; j++)
      for (let k = 0; k < count; k++) points.push([at(0, i), at(1, j), at(2, k)]);
  return points;
}

const centreOf = ({ min, max }: Bounds): Vec3 => scale(add(min, max), 0.5);

describe('billboard', () => {
  test('covers, from where it was framed, every point of the box, and no more on any side', () => {
    fc.assert(
      fc.property(boxes, kinds, vec3(2), (box, { turning, facing }, eye) => {
        const basis = facingBasis(turning, facing, CAMERA, subtract(centreOf(box), eye));
        const frame = frameBox(boxCorners(box), eye, basis, 0.1);
        expect(frame).toBeDefined();
        if (frame === undefined) return;
        const { centre, right, up } = billboard(frame);
        let reach = [Infinity, -Infinity, Infinity, -Infinity];
        for (const point of samples(box)) {
          // Where the line of sight through the point meets the billboard's plane.
          const ray = subtract(point, eye);
          const t = dot(subtract(centre, eye), basis.forward) / dot(ray, basis.forward);
          expect(t).toBeLessThanOrEqual(1 + 1e-9); // no point lies before the billboard
          const hit = subtract(add(eye, scale(ray, t)), centre);
          const x = dot(hit, right) / dot(right, right);
          const y = dot(hit, up) / dot(up, up);
          expect(Math.max(Math.abs(x), Math.abs(y))).toBeLessThan(1 + 1e-9);
          reach = [
            Math.min(reach[0], x),
            Math.max(reach[1], x),
            Math.min(reach[2], y),
            Math.max(reach[3], y),
          ];
        }
        [-1, 1, -1, 1].forEach((edge, n) => expect(reach[n]).toBeCloseTo(edge, 9));
      }),
    );
  });

  test('lies at the nearest depth of the box', () => {
    fc.assert(
      fc.property(boxes, (box) => {
        const frame = frameBox(boxCorners(box), [0, 0, 0], CAMERA, 0.1);
        const nearest = Math.min(...samples(box).map((point) => -point[2]));
        expect(frame?.near).toBeCloseTo(nearest, 9);
        expect(frame && -billboard(frame).centre[2]).toBeCloseTo(nearest, 9);
      }),
    );
  });

  test('is refused where the box reaches through the near plane', () => {
    const box: Bounds = { min: [-1, -1, -4], max: [1, 1, 1] };
    expect(frameBox(boxCorners(box), [0, 0, 0], CAMERA, 0.1)).toBeUndefined();
  });

  test('has margins of whole texels', () => {
    const box: Bounds = { min: [-1, -2, -9], max: [1, 2, -8] };
    const frame = frameBox(boxCorners(box), [0, 0, 0], CAMERA, 0.1);
    if (frame === undefined) throw new Error('in view');
    const padded = padFrame(frame, 64, 2);
    const texel = (padded.rightmost - padded.left) / 64;
    expect(frame.left - padded.left).toBeCloseTo(2 * texel, 12);
    expect(padded.top - frame.top).toBeCloseTo((2 * (padded.top - padded.bottom)) / 64, 12);
    expect(framePixels(frame, 400)).toBeCloseTo((400 * 4) / 8, 9);
  });
});

describe('facingBasis', () => {
  const orthonormal = ({ right, up, forward }: Basis): void => {
    for (const axis of [right, up, forward]) expect(length(axis)).toBeCloseTo(1, 9);
    const turned = cross(right, up);
    [0, 1, 2].forEach((n) => expect(turned[n]).toBeCloseTo(-forward[n], 9));
  };

  test('is orthonormal whatever it faces, straight up and down too', () => {
    fc.assert(
      fc.property(kinds, vec3(1), vec3(1), ({ turning, facing }, look, towards) => {
        const forward = unit(look) ?? [0, 0, -1];
        const right = unit(cross(forward, [0.3, 1, 0.2])) ?? [1, 0, 0];
        const camera = { forward, right, up: cross(right, forward) };
        orthonormal(facingBasis(turning, facing, camera, towards));
      }),
    );
    const down: Basis = { right: [1, 0, 0], up: [0, 0, -1], forward: [0, -1, 0] };
    for (const facing of ['camera', 'camera-plane'] as const) {
      orthonormal(facingBasis('cylindrical', facing, down, [0, -1, 0]));
    }
  });

  test('spherical ones face the camera plane, or the camera itself', () => {
    expect(facingBasis('spherical', 'camera-plane', CAMERA, [5, 0, -5]).forward).toEqual([
      0, 0, -1,
    ]);
    const facing = facingBasis('spherical', 'camera', CAMERA, [5, 0, -5]).forward;
    expect(facing[0]).toBeCloseTo(Math.SQRT1_2, 12);
    expect(facing[2]).toBeCloseTo(-Math.SQRT1_2, 12);
  });

  test('cylindrical ones stay upright, however the camera is pitched', () => {
    const pitched: Basis = { right: [1, 0, 0], up: [0, 0.8, -0.6], forward: [0, -0.6, -0.8] };
    for (const facing of ['camera', 'camera-plane'] as const) {
      const { up, forward } = facingBasis('cylindrical', facing, pitched, [3, -4, -3]);
      expect(up[1]).toBeCloseTo(1, 12);
      expect(forward[1]).toBeCloseTo(0, 12);
    }
  });
});
