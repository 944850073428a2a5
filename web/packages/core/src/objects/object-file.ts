/** object.json of `farfield bake-object`, and from where on what it describes is good enough. */

import { FarfieldError } from '../errors.js';
import type { Vec3 } from '../format.js';

export interface ObjectFile {
  readonly format: 'farfield-object';
  readonly version: 1;
  readonly name: string;
  /** Its box, metres. */
  readonly low: Vec3;
  readonly high: Vec3;
  /** Which axis of the box texture x, texture y and height run along. */
  readonly axes: Vec3;
  readonly resolution: number;
  /** Height textures, of two slabs each. */
  readonly textures: number;
  /** PNG: height textures, then colour and normal of each height, from the top down. */
  readonly image: string;
  readonly triangles: number;
  /** 95 % of the outline is nearer to the mesh's than this, metres. */
  readonly error: number;
}

/** Layers of the image. */
export function objectLayers({ textures }: ObjectFile): number {
  return 9 * textures;
}

/** Read object.json; throws FarfieldError 'format'. */
export function parseObject(text: string): ObjectFile {
  let file: Partial<Record<keyof ObjectFile, unknown>> | null;
  try {
    file = JSON.parse(text) as Partial<Record<keyof ObjectFile, unknown>> | null;
  } catch {
    throw new FarfieldError('format', 'An object file is not JSON.');
  }
  if (file?.format !== 'farfield-object' || file.version !== 1) {
    throw new FarfieldError('format', 'An object file is not of the version this viewer reads.');
  }
  if (!fits(file)) throw new FarfieldError('format', 'An object file contradicts itself.');
  return file as unknown as ObjectFile;
}

/** Whether what decides memory and mathematics is as docs/format.md says. */
function fits(file: Partial<Record<keyof ObjectFile, unknown>>): boolean {
  const { low, high, axes, resolution, textures, image, error } = file;
  const within = (value: unknown, least: number, most: number): boolean =>
    Number.isInteger(value) && Number(value) >= least && Number(value) <= most;
  const triple = (value: unknown): value is Vec3 =>
    Array.isArray(value) && value.length === 3 && value.every((n) => Number.isFinite(n));
  return (
    triple(low) &&
    triple(high) &&
    [0, 1, 2].every((axis) => high[axis] > low[axis]) &&
    triple(axes) &&
    [...axes].sort().join() === '0,1,2' &&
    within(resolution, 2, 4096) &&
    within(textures, 1, 8) &&
    typeof image === 'string' &&
    /^[0-9A-Za-z._-]+$/.test(image) &&
    typeof error === 'number' &&
    error >= 0
  );
}

/**
 * How near an object of some scale may be drawn from height fields, metres: there its error, or one
 * texel if that is more, is `pixels` pixels; nearer, polygons are drawn.
 *
 * @param focal pixels per unit of slope
 */
export function switchDistance(file: ObjectFile, focal: number, scale = 1, pixels = 1): number {
  const texel = Math.max(...[0, 1, 2].map((n) => file.high[n] - file.low[n])) / file.resolution;
  return (scale * Math.max(file.error, texel) * focal) / pixels;
}
