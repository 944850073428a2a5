/**
 * Vertices of a cell's quads (docs/format.md, "Drawing a quad").
 *
 * A corner at (u, v) with disparity d is the homogeneous point (forward + u right + v down + d e, d).
 * It is stored relative to the cell's centre c, as (forward + u right + v down + d (e - c), d), so
 * single precision holds however far from the origin the scene lies.
 */

import { FACES } from './faces.js';
import { FarfieldError } from './errors.js';
import type { CellFile } from './format.js';

/** Pages a cell may have, and quads that are told apart: their product fits single precision. */
export const PAGES = 2048;
export const QUADS = 8192;

export interface QuadVertices {
  /** 4 per vertex: homogeneous position relative to the cell's centre. */
  readonly positions: Float32Array<ArrayBuffer>;
  /**
   * 3 per vertex: texel column and row on the page, and the index of the page in `atlases` plus
   * PAGES times the quad's number (for overlays; it starts again after QUADS of them).
   */
  readonly texels: Float32Array<ArrayBuffer>;
  /**
   * 3 per triangle, in the order of the file: front to back. Counter-clockwise as seen from the
   * quad's own eye, from whose side of its plane alone it is seen.
   */
  readonly indices: Uint32Array<ArrayBuffer>;
  readonly quads: number;
}

/** Build the vertices of all quads of `cell`; `resolution` is walk.json's. */
export function buildQuadVertices(cell: CellFile, resolution: number): QuadVertices {
  const { quads } = cell;
  const count = quads.faces.length;
  let vertices = 0;
  for (const corners of quads.corner_counts) {
    if (!(corners >= 3 && corners <= 8)) {
      throw new FarfieldError('format', `A quad has ${corners} corners; 3 to 8 are allowed.`);
    }
    vertices += corners;
  }
  checkColumns(cell, vertices);
  const positions = new Float32Array(4 * vertices);
  const texels = new Float32Array(3 * vertices);
  const indices = new Uint32Array(3 * (vertices - 2 * count));
  const [cx, cy, cz] = cell.eyes[0];
  let vertex = 0;
  let index = 0;
  for (let q = 0; q < count; q++) {
    const { forward, right, down } = FACES[quads.faces[q]];
    const eye = cell.eyes[quads.eyes[q]];
    const [ex, ey, ez] = [eye[0] - cx, eye[1] - cy, eye[2] - cz];
    const [a, b, c] = [quads.planes[3 * q], quads.planes[3 * q + 1], quads.planes[3 * q + 2]];
    const scale = quads.scales[q];
    const turned = quads.turned[q] !== 0;
    const first = vertex;
    let area = 0;
    for (let corner = 0; corner < quads.corner_counts[q]; corner++, vertex++) {
      const x = quads.corners[2 * vertex];
      const y = quads.corners[2 * vertex + 1];
      const u = (2 * x) / resolution - 1;
      const v = (2 * y) / resolution - 1;
      const d = Math.max(0, a * u + b * v + c);
      positions[4 * vertex] = forward[0] + u * right[0] + v * down[0] + d * ex;
      positions[4 * vertex + 1] = forward[1] + u * right[1] + v * down[1] + d * ey;
      positions[4 * vertex + 2] = forward[2] + u * right[2] + v * down[2] + d * ez;
      positions[4 * vertex + 3] = d;
      texels[3 * vertex] = scale * (turned ? y : x) + quads.offsets[2 * q];
      texels[3 * vertex + 1] = scale * (turned ? x : y) + quads.offsets[2 * q + 1];
      texels[3 * vertex + 2] = quads.pages[q] + PAGES * (q % QUADS);
      if (corner >= 2) area += doubleArea(quads.corners, first, vertex);
    }
    // corners may go round either way; in rows that go down, a positive area is clockwise
    const swap = area > 0 ? 1 : 0;
    for (let corner = first + 2; corner < vertex; corner++) {
      indices[index++] = first;
      indices[index++] = corner - 1 + swap;
      indices[index++] = corner - swap;
    }
  }
  return { positions, texels, indices, quads: count };
}

/** Twice the signed area of the triangle of three corners: `first`, and the two up to `last`. */
function doubleArea(corners: readonly number[], first: number, last: number): number {
  const [x, y] = [corners[2 * first], corners[2 * first + 1]];
  const [bx, by] = [corners[2 * last - 2] - x, corners[2 * last - 1] - y];
  const [cx, cy] = [corners[2 * last] - x, corners[2 * last + 1] - y];
  return bx * cy - cx * by;
}

/** Refuse a cell whose columns do not fit together, before anything reads past an end. */
function checkColumns(cell: CellFile, vertices: number): void {
  const { quads } = cell;
  const count = quads.faces.length;
  const lengths: [string, number, number][] = [
    ['eyes', quads.eyes.length, count],
    ['corner_counts', quads.corner_counts.length, count],
    ['corners', quads.corners.length, 2 * vertices],
    ['planes', quads.planes.length, 3 * count],
    ['pages', quads.pages.length, count],
    ['scales', quads.scales.length, count],
    ['offsets', quads.offsets.length, 2 * count],
    ['turned', quads.turned.length, count],
  ];
  for (const [name, has, wants] of lengths) {
    if (has !== wants) {
      throw new FarfieldError(
        'format',
        `Column "${name}" has ${has} entries where ${wants} are needed.`,
      );
    }
  }
  if (cell.atlases.length > PAGES) {
    throw new FarfieldError('format', `A cell has more than ${PAGES} atlas pages.`);
  }
  const outside = (column: readonly number[], limit: number): boolean =>
    column.some((value) => !(value >= 0 && value < limit));
  if (outside(quads.eyes, cell.eyes.length)) {
    throw new FarfieldError('format', 'A quad refers to an eye that the cell does not list.');
  }
  if (outside(quads.faces, FACES.length)) {
    throw new FarfieldError('format', 'A quad lies on a face other than 0 to 5.');
  }
  if (outside(quads.pages, cell.atlases.length)) {
    throw new FarfieldError(
      'format',
      'A quad refers to an atlas page that the cell does not list.',
    );
  }
}
