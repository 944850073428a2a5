import { describe, expect, test } from 'vitest';
import { FarfieldError, parseManifest } from '../src/index.js';

export const WALK = {
  format: 'farfield-walk',
  version: 1,
  id: 'b',
  name: 'A walk',
  scene: { id: 's', name: 'A scene', triangles: 1, bounds: { min: [0, 0, 0], max: [1, 1, 1] } },
  settings: {},
  resolution: 512,
  layers: [],
  borders: [],
  near_field: 20,
  grid: {
    origin: [0, 0, 0],
    size: [1, 1, 1],
    total: 1,
    cells: { i: [0], j: [0], k: [0], y: [0] },
    pages: [],
  },
  atlas: { width: 64, height: 64, encoding: 'png' },
  light: Object.fromEntries(
    [
      'ambient',
      'sun_direction',
      'sun',
      'hemisphere_up',
      'hemisphere_down',
      'sky_zenith',
      'sky_horizon',
      'sky_ground',
    ].map((name) => [name, [0.1, 0.2, 0.3]]),
  ),
  places: { cells: 'cells/', atlases: '../../blobs/atlases/', near: '../../blobs/near/' },
  start: { eye: [0.5, 0.5, 0.5], yaw: 0, pitch: 0 },
};

const URL_ = 'https://example.org/store/bakes/b/walk.json?x=1';
const parse = (value: unknown) =>
  parseManifest(new TextEncoder().encode(JSON.stringify(value)).buffer, URL_);

describe('parseManifest', () => {
  test('addresses are relative to walk.json', () => {
    const manifest = parse(WALK);
    expect(manifest.cellUrl('0_0_-3')).toBe('https://example.org/store/bakes/b/cells/0_0_-3.json');
    expect(manifest.atlasUrl('a.png')).toBe('https://example.org/store/blobs/atlases/a.png');
    expect(manifest.nearUrl('n.glb')).toBe('https://example.org/store/blobs/near/n.glb');
    const elsewhere = parse({ ...WALK, places: { ...WALK.places, cells: 'https://cdn.net/c/' } });
    expect(elsewhere.cellUrl('0_0_0')).toBe('https://cdn.net/c/0_0_0.json');
  });

  test('null cells beside pages are a paged grid', () => {
    const page = { href: 'pages/0.json', cells: 1, bounds: { min: [0, 0, 0], max: [1, 1, 1] } };
    const grid = { ...WALK.grid, cells: null, pages: [page] };
    expect(parse({ ...WALK, grid }).walk.grid.pages).toHaveLength(1);
  });

  test.each([
    [null, 'not a Farfield walk'],
    [[], 'not a Farfield walk'],
    [{ ...WALK, format: 'x' }, 'not a Farfield walk'],
    [{ ...WALK, version: 2 }, 'version 2'],
    [{ ...WALK, version: undefined }, 'version undefined'],
    [{ ...WALK, grid: {} }, '"grid"'],
    [{ ...WALK, grid: { ...WALK.grid, size: [1, 2] } }, '"grid"'],
    [{ ...WALK, grid: { ...WALK.grid, cells: { i: [0], j: [], k: [0], y: [0] } } }, '"grid.cells"'],
    [{ ...WALK, atlas: { width: 0, height: 3 } }, '"atlas"'],
    [{ ...WALK, light: { ...WALK.light, sun: 'bright' } }, '"light"'],
    [{ ...WALK, places: { cells: 'cells/' } }, '"places"'],
    [{ ...WALK, start: {} }, '"start"'],
    [{ ...WALK, resolution: 0 }, '"resolution"'],
    [{ ...WALK, near_field: 'far' }, '"near_field"'],
  ])('refuses %#', (value, says) => {
    expect(() => parse(value)).toThrow(FarfieldError);
    expect(() => parse(value)).toThrow(says);
  });

  test('refuses what is not JSON', () => {
    expect(() => parseManifest(new TextEncoder().encode('<html>').buffer, URL_)).toThrow(
      'not JSON',
    );
  });
});
