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
  let file: ObjectFile;
  try {
    file = JSON.parse(text) as ObjectFile;
  } catch {
    throw new FarfieldError('format', 'An object file is not JSON.');
  }
  const { format, version } = file as { format: unknown; version: unknown };
  if (format !== 'farfield-object' || version !== 1) {
    throw new FarfieldError('format', 'An object file is not of the version this viewer reads.');
  }
  const fits =
    Number.isInteger(file.resolution) &&
    file.resolution > 0 &&
    Number.isInteger(file.textures) &&
    file.textures > 0 &&
    [...file.axes].sort().join() === '0,1,2' &&
    [0, 1, 2].every((axis) => file.high[axis] > file.low[axis]);
  if (!fits) throw new FarfieldError('format', 'An object file contradicts itself.');
  return file;
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
