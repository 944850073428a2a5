import { InlineBuilder, type Manifest, type NearSource, type Vec3 } from '@farfield/core';
import { RawShaderMaterial } from 'three';
import { describe, expect, test } from 'vitest';
import { makeGlb } from '../../core/test/glb-maker.js';
import { CellLoader, type CellLoaderParts } from '../src/cell-loader.js';
import { NearMaterials } from '../src/near-materials.js';

const LIGHT = {
  ambient: [0.1, 0.1, 0.1],
  sun_direction: [0, 1, 0],
  sun: [1, 1, 1],
  hemisphere_up: [0, 0, 0],
  hemisphere_down: [0, 0, 0],
  sky_zenith: [0, 0, 1],
  sky_horizon: [1, 1, 1],
  sky_ground: [0, 1, 0],
} as const;

const EMPTY_QUADS = {
  eyes: [],
  faces: [],
  layers: [],
  corner_counts: [],
  corners: [],
  planes: [],
  pages: [],
  scales: [],
  offsets: [],
  turned: [],
};

/** A block of one triangle at x = `n`, and of half a megabyte that nobody lists. */
function block(n: number): ArrayBuffer {
  return makeGlb(
    { nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }] },
    [
      {
        data: new Float32Array([n, 0, 0, n, 1, 0, n, 0, 1]),
        componentType: 5126,
        type: 'VEC3',
        count: 3,
      },
      { data: new Uint8Array(2 ** 19), componentType: 5121, type: 'SCALAR', count: 2 ** 19 },
    ],
  );
}

/** A loader of one cell with `count` blocks; `broken` is not there. Counts blocks that are held. */
function makeLoader(count: number, broken = -1, added = (): void => undefined) {
  const held = { now: 0, most: 0, cancelled: 0 };
  const cell = {
    format: 'farfield-cell',
    version: 1,
    cell: [0, 0, 0],
    eyes: [[0, 0, 0]],
    quads: EMPTY_QUADS,
    atlases: [],
    near: Array.from({ length: count }, (_, n) => ({ blob: `${n}.glb`, ranges: [0, 0, 1] })),
    figures: {},
  };
  const get = (url: string): Promise<ArrayBuffer> => {
    if (url === 'cell') {
      return Promise.resolve(new TextEncoder().encode(JSON.stringify(cell)).buffer);
    }
    const n = parseInt(url);
    if (n === broken) return Promise.resolve(new ArrayBuffer(40));
    held.most = Math.max(held.most, ++held.now);
    return Promise.resolve(block(n));
  };
  const inline = new InlineBuilder();
  const near = (centre: Vec3, size: Vec3) => {
    const job = inline.near(centre, size);
    return {
      add: async (source: NearSource) => {
        await job.add(source);
        held.now--;
        added();
      },
      finish: () => job.finish(),
      cancel: () => held.cancelled++,
    };
  };
  const manifest = {
    walk: { resolution: 64, near_field: 1000, grid: { size: [8, 8, 8] } },
    cellUrl: () => 'cell',
    nearUrl: (name: string) => name,
  } as unknown as Manifest;
  const parts = {
    manifest,
    queue: { get },
    builder: { cell: inline.cell.bind(inline), near },
    materials: new NearMaterials(LIGHT, 1000, false),
    farMaterial: new RawShaderMaterial(),
    attributes: { add: () => Promise.resolve() },
    shapes: undefined,
    compile: () => Promise.resolve(),
  };
  return { held, loader: new CellLoader(parts as unknown as CellLoaderParts) };
}

const JOB = {
  cell: { name: '0_0_0', index: [0, 0, 0], box: {} } as never,
  priority: () => 0,
};

describe('CellLoader', () => {
  test('loads a near field of more blocks than are kept, a few at a time', async () => {
    const { held, loader } = makeLoader(120);
    const { view } = await loader.load({ ...JOB, signal: new AbortController().signal });
    expect(view.nearTriangles).toBe(120);
    expect(held.most).toBeLessThanOrEqual(8);
    expect(held).toMatchObject({ now: 0, cancelled: 0 });
    view.dispose();
  });

  test('a block that cannot be read fails the cell and ends what was begun', async () => {
    const { held, loader } = makeLoader(30, 20);
    const signal = new AbortController().signal;
    await expect(loader.load({ ...JOB, signal })).rejects.toThrow('not a glTF');
    expect(held.cancelled).toBe(1);
  });

  test('a cell that is called off is let go of at once', async () => {
    const abort = new AbortController();
    const { held, loader } = makeLoader(30, -1, () => abort.abort());
    await expect(loader.load({ ...JOB, signal: abort.signal })).rejects.toThrow();
    expect(held.cancelled).toBe(1);
  });
});
