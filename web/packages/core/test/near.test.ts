import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import {
  FarfieldError,
  NearBuild,
  textureKey,
  type NearBatch,
  type NearSource,
} from '../src/index.js';
import { makeGlb } from './glb-maker.js';

const VERTICES = 6;
const TRIANGLES = [0, 1, 2, 2, 1, 3, 3, 4, 5, 5, 0, 1];
const STEP = 0.25;
const START = [100, -20, 3000];

/** A block with two primitives over shared vertices; each has its own material. */
function block(materials: object[], root: object = {}): ArrayBuffer {
  const positions = Uint16Array.from({ length: 4 * VERTICES }, (_, n) => (n % 4 === 3 ? 0 : n * 7));
  const normals = Int8Array.from({ length: 4 * VERTICES }, (_, n) => [0, 127, 0, 0][n % 4]);
  const uvs = Float32Array.from({ length: 2 * VERTICES }, (_, n) => n / 4);
  const colors = Uint16Array.from({ length: 4 * VERTICES }, (_, n) => n * 2000);
  const attributes = { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2, COLOR_0: 3 };
  return makeGlb(
    {
      nodes: [{ mesh: 0, translation: START, scale: [STEP, STEP, STEP] }],
      meshes: [
        { primitives: materials.map((_, material) => ({ attributes, indices: 4, material })) },
      ],
      materials,
      images: [{ uri: 'wood.png' }],
      samplers: [{ wrapS: 33071, wrapT: 33648, magFilter: 9728 }],
      textures: [{ source: 0, sampler: 0 }],
      ...root,
    },
    [
      { data: positions, componentType: 5123, type: 'VEC3', count: VERTICES, byteStride: 8 },
      {
        data: normals,
        componentType: 5120,
        type: 'VEC3',
        count: VERTICES,
        normalized: true,
        byteStride: 4,
      },
      { data: uvs, componentType: 5126, type: 'VEC2', count: VERTICES },
      { data: colors, componentType: 5123, type: 'VEC4', count: VERTICES, normalized: true },
      { data: Uint16Array.from(TRIANGLES), componentType: 5123, type: 'SCALAR', count: 12 },
    ],
  );
}

const TEXTURED = { pbrMetallicRoughness: { baseColorTexture: { index: 0 } } };

function build(sources: NearSource[], centre: [number, number, number] = [0, 0, 0]): NearBatch[] {
  const near = new NearBuild(centre);
  for (const source of sources) near.add(source);
  return near.finish();
}

describe('NearBuild', () => {
  test('draws exactly the listed triangles, where they are, the nearest first', () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(fc.nat(3), fc.nat(4)), { minLength: 1, maxLength: 4 }),
        fc.tuple(...[0, 1, 2].map(() => fc.integer({ min: -4000, max: 4000 }))),
        (pairs, [x, y, z]) => {
          const ranges = pairs.flatMap(([first, count]) => [0, first, Math.min(count, 4 - first)]);
          const [batch] = build([{ bytes: block([{}]), ranges }], [x, y, z]);
          const listed: number[][] = [];
          for (let n = 0; n < ranges.length; n += 3) {
            for (let t = ranges[n + 1]; t < ranges[n + 1] + ranges[n + 2]; t++) {
              const corners = TRIANGLES.slice(3 * t, 3 * t + 3).flatMap((vertex) =>
                [0, 1, 2].map(
                  (axis) => START[axis] + STEP * (4 * vertex + axis) * 7 - [x, y, z][axis],
                ),
              );
              listed.push(corners);
            }
          }
          const distance = (corners: number[]): number =>
            Math.min(...[0, 3, 6].map((c) => Math.hypot(...corners.slice(c, c + 3))));
          // Sorting is stable: among equals the order of the files stays.
          const wanted = listed.sort((a, b) => distance(a) - distance(b)).flat();
          const got = [...batch.indices].flatMap((vertex) => [
            ...batch.positions.subarray(3 * vertex, 3 * vertex + 3),
          ]);
          expect(got).toEqual(wanted);
          // No vertex is there without need.
          expect(new Set(batch.indices).size).toBe(batch.positions.length / 3);
        },
      ),
    );
  });

  test('normals, colours and texture coordinates come as they are stored', () => {
    const [batch] = build([{ bytes: block([TEXTURED]), ranges: [0, 2, 1] }]);
    expect([...batch.normals.subarray(0, 4)]).toEqual([0, 127, 0, 0]);
    expect([...batch.colors.subarray(0, 4)]).toEqual([24000, 26000, 28000, 30000]);
    expect([...batch.uvs.subarray(0, 2)]).toEqual([1.5, 1.75]);
  });

  test('pieces of equal state are merged across blocks, others are not', () => {
    const sources = [
      { bytes: block([{}, TEXTURED]), ranges: [0, 0, 1, 1, 0, 2] },
      { bytes: block([TEXTURED, { doubleSided: true }]), ranges: [0, 0, 3, 1, 1, 1] },
    ];
    const batches = build(sources);
    expect(batches.map(({ indices }) => indices.length / 3)).toEqual([1, 5, 1]);
    expect(batches.map(({ state }) => state.map?.uri)).toEqual([undefined, 'wood.png', undefined]);
    expect(batches.map(({ uvs }) => uvs.length > 0)).toEqual([false, true, false]);
    expect(Math.max(...batches[1].indices)).toBe(batches[1].positions.length / 3 - 1);
  });

  test('needs nothing of a block after it was added', () => {
    const sources = [0, 1].map(() => ({
      bytes: block([{}, TEXTURED]),
      ranges: [0, 0, 1, 1, 1, 2],
    }));
    const near = new NearBuild([0, 0, 0]);
    for (const { bytes, ranges } of sources) {
      const lent = bytes.slice(0);
      near.add({ bytes: lent, ranges });
      new Uint8Array(lent).fill(255);
    }
    expect(near.finish()).toEqual(build(sources));
  });

  test('reads every state', () => {
    const material = {
      ...TEXTURED,
      emissiveFactor: [0.1, 0.2, 0.3],
      emissiveTexture: { index: 0 },
      alphaMode: 'MASK',
      alphaCutoff: 0.25,
      doubleSided: true,
      extensions: {
        KHR_materials_unlit: {},
        KHR_materials_emissive_strength: { emissiveStrength: 2 },
      },
    };
    const [{ state }] = build([{ bytes: block([material]), ranges: [0, 0, 1] }]);
    const texture = {
      uri: 'wood.png',
      wrapS: 'clamp',
      wrapT: 'mirror',
      filter: 'nearest',
    } as const;
    expect(state).toEqual({
      map: texture,
      emissiveMap: texture,
      emissive: [0.2, 0.4, 0.6],
      alpha: 'mask',
      cutoff: 0.25,
      doubleSided: true,
      unlit: true,
    });
    expect(textureKey(texture)).not.toBe(textureKey({ ...texture, wrapS: 'repeat' }));
  });

  test('what is dithered says so in its extras', () => {
    const [{ state }] = build([
      { bytes: block([{ alphaMode: 'BLEND', extras: { alpha: 'dither' } }]), ranges: [0, 0, 1] },
    ]);
    expect(state.alpha).toBe('dither');
  });

  test('a base colour factor multiplies, a texture transform moves', () => {
    const material = {
      pbrMetallicRoughness: {
        baseColorFactor: [0.5, 1, 1, 1],
        baseColorTexture: {
          index: 0,
          extensions: { KHR_texture_transform: { offset: [10, 20], scale: [2, 4] } },
        },
      },
    };
    const [batch] = build([{ bytes: block([material]), ranges: [0, 2, 1] }]);
    expect(batch.colors[0]).toBe(12000);
    expect([...batch.uvs.subarray(0, 2)]).toEqual([13, 27]);
  });

  test.each([
    ['no GLB at all', new ArrayBuffer(40), [0, 0, 1], 'not a glTF'],
    ['a primitive too many', block([{}]), [1, 0, 1], 'primitive 1'],
    ['a triangle too many', block([{}]), [0, 3, 2], 'does not have'],
    [
      'a turned node',
      block([{}], { nodes: [{ mesh: 0, rotation: [0, 1, 0, 0] }] }),
      [0, 0, 1],
      'moved and scaled',
    ],
    [
      'an unknown extension',
      block([{}], { extensionsRequired: ['KHR_draco_mesh_compression'] }),
      [0, 0, 1],
      'KHR_draco',
    ],
    ['half a file', block([{}]).slice(0, 200), [0, 0, 1], 'cut short'],
  ])('refuses %s', (_, bytes, ranges, says) => {
    expect(() => build([{ bytes, ranges }])).toThrow(FarfieldError);
    expect(() => build([{ bytes, ranges }])).toThrow(says);
  });
});
