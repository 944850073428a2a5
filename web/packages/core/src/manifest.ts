/** walk.json: loading, checking, and the addresses that follow from it. */

import { FarfieldError } from './errors.js';
import { WALK_VERSION, type Light, type WalkFile } from './format.js';

const LIGHT_NAMES: readonly (keyof Light)[] = [
  'ambient',
  'sun_direction',
  'sun',
  'hemisphere_up',
  'hemisphere_down',
  'sky_zenith',
  'sky_horizon',
  'sky_ground',
];

/** A checked walk.json and where it came from. */
export class Manifest {
  readonly walk: WalkFile;
  readonly url: string;

  constructor(walk: unknown, url: string) {
    checkWalk(walk, url);
    this.walk = walk;
    this.url = url;
  }

  cellUrl(name: string): string {
    return this.resolve(`${this.walk.places.cells}${name}.json`);
  }

  atlasUrl(name: string): string {
    return this.resolve(this.walk.places.atlases + name);
  }

  nearUrl(name: string): string {
    return this.resolve(this.walk.places.near + name);
  }

  /** An address relative to walk.json. */
  resolve(href: string): string {
    return new URL(href, this.url).href;
  }
}

/** Make an address absolute, against the page where there is one. */
export function absoluteUrl(url: string): string {
  return new URL(url, typeof location === 'undefined' ? undefined : location.href).href;
}

/** Read a manifest from bytes; throws FarfieldError 'format' with the reason. */
export function parseManifest(bytes: ArrayBuffer, url: string): Manifest {
  let value: unknown;
  try {
    value = JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    throw new FarfieldError('format', `${url} is not JSON, so it is not a walk.`);
  }
  return new Manifest(value, url);
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function isTriple(value: unknown): boolean {
  return Array.isArray(value) && value.length === 3 && value.every((n) => Number.isFinite(n));
}

function checkWalk(walk: unknown, url: string): asserts walk is WalkFile {
  if (!isRecord(walk) || walk.format !== 'farfield-walk') {
    throw new FarfieldError('format', `${url} is not a Farfield walk.`);
  }
  if (walk.version !== WALK_VERSION) {
    throw new FarfieldError(
      'format',
      `The walk has version ${String(walk.version)}, and this viewer reads version ${WALK_VERSION}; use a newer viewer.`,
    );
  }
  const bad = (member: string): never => {
    throw new FarfieldError('format', `walk.json has no valid "${member}".`);
  };
  const { grid, atlas, light, places, start } = walk;
  if (!isRecord(grid) || !isTriple(grid.origin) || !isTriple(grid.size)) return bad('grid');
  if (!isRecord(grid.cells) && !Array.isArray(grid.pages)) return bad('grid');
  if (isRecord(grid.cells)) {
    const { i, j, k, y } = grid.cells;
    const columns = [i, j, k, y];
    const first: unknown = columns[0];
    if (
      !columns.every((c) => Array.isArray(c) && Array.isArray(first) && c.length === first.length)
    )
      return bad('grid.cells');
  }
  if (!isRecord(atlas) || !(Number(atlas.width) > 0) || !(Number(atlas.height) > 0))
    return bad('atlas');
  if (!isRecord(light) || !LIGHT_NAMES.every((name) => isTriple(light[name]))) return bad('light');
  if (
    !isRecord(places) ||
    !['cells', 'atlases', 'near'].every((name) => typeof places[name] === 'string')
  )
    return bad('places');
  if (!isRecord(start) || !isTriple(start.eye)) return bad('start');
  if (!(Number(walk.resolution) > 0)) return bad('resolution');
  if (!(Number(walk.near_field) >= 0)) return bad('near_field');
}
