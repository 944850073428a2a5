/**
 * Near geometry of one cell: the triangles its near blocks list, merged per draw state.
 *
 * Blocks share vertices between cells on disk; in memory each cell gets buffers of its own, so it
 * draws with one call per state however many blocks it touches, and its positions are relative to
 * its centre, where single precision is finest.
 */

import { FarfieldError } from './errors.js';
import type { Vec3 } from './format.js';
import { CopyList } from './objects/copies.js';
import { parseGlb, readAccessor, type AccessorView, type Glb } from './glb.js';
import { readMaterial, stateKey, type NearMaterial, type NearState } from './near-material.js';

/** Near polygons are drawn up to this multiple of `near_field`, so that no crack opens there. */
export const NEAR_OVERLAP = 17 / 16;

/** Triangles of one draw state. */
export interface NearBatch {
  readonly state: NearState;
  /** 3 per vertex, relative to the cell's centre. */
  readonly positions: Float32Array<ArrayBuffer>;
  /** 4 per vertex, unit normals times 127, last component 0. */
  readonly normals: Int8Array<ArrayBuffer>;
  /** 2 per vertex; empty where the state has no texture. */
  readonly uvs: Float32Array<ArrayBuffer>;
  /** 4 per vertex, linear base colour and opacity times 65535. */
  readonly colors: Uint16Array<ArrayBuffer>;
  readonly indices: Uint32Array<ArrayBuffer>;
  /** Number of the copy that each triangle is part of, -1 for none; empty where there are no copies. */
  readonly owners: Int32Array<ArrayBuffer>;
}

/** A near block's bytes and the triangles wanted of it, as in a cell file. */
export interface NearSource {
  readonly bytes: ArrayBuffer;
  readonly ranges: readonly number[];
}

interface Piece {
  readonly primitive: Primitive;
  readonly material: NearMaterial;
  /** For each new vertex, its number in the primitive. */
  readonly vertices: Uint32Array;
  /** Corners, as numbers of new vertices. */
  readonly corners: Uint32Array;
  /** Number of each triangle's copy, -1 for none. */
  readonly owners: Int32Array;
}

interface Primitive {
  readonly position: AccessorView;
  readonly normal: AccessorView | undefined;
  readonly uv: AccessorView | undefined;
  readonly color: AccessorView | undefined;
  readonly indices: AccessorView | undefined;
  readonly owners: AccessorView | undefined;
  readonly translation: Vec3;
  readonly scale: Vec3;
}

/**
 * Merge the listed triangles of `sources`, relative to `centre`; batches, and triangles in them, in
 * the order in which they are best drawn. Copies of objects among them are added to `list`. Throws
 * FarfieldError 'format'.
 */
export function buildNearBatches(
  sources: readonly NearSource[],
  centre: Vec3,
  list = new CopyList(),
): NearBatch[] {
  const groups = new Map<string, Piece[]>();
  for (const { bytes, ranges } of sources) {
    const glb = parseGlb(bytes);
    const copies = list.add(glb);
    const perPrimitive = new Map<number, [number, number][]>();
    for (let n = 0; n + 2 < ranges.length; n += 3) {
      const wanted = perPrimitive.get(ranges[n]) ?? [];
      wanted.push([ranges[n + 1], ranges[n + 2]]);
      perPrimitive.set(ranges[n], wanted);
    }
    for (const [number, wanted] of perPrimitive) {
      const { primitive, material } = readPrimitive(glb, number);
      const key = stateKey(material.state);
      const pieces = groups.get(key) ?? [];
      pieces.push({ primitive, material, ...collect(primitive, wanted, copies) });
      groups.set(key, pieces);
    }
  }
  const owned = list.copies.length > 0;
  const batches = [...groups.values()].map((pieces) => merge(pieces, centre, owned));
  return batches.sort((a, b) => middle(a) - middle(b));
}

function readPrimitive(glb: Glb, number: number): { primitive: Primitive; material: NearMaterial } {
  const node = glb.json.nodes?.find((candidate) => candidate.mesh !== undefined);
  const source = glb.json.meshes?.at(node?.mesh ?? 0)?.primitives.at(number);
  const position = source?.attributes.POSITION;
  if (source === undefined || position === undefined || (source.mode ?? 4) !== 4) {
    throw new FarfieldError('format', `A near block has no triangles as primitive ${number}.`);
  }
  if (node?.rotation !== undefined || node?.matrix !== undefined) {
    throw new FarfieldError('format', 'The node of a near block may only be moved and scaled.');
  }
  const read = (index: number | undefined): AccessorView | undefined =>
    index === undefined ? undefined : readAccessor(glb, index);
  const [tx, ty, tz] = node?.translation ?? [0, 0, 0];
  const [sx, sy, sz] = node?.scale ?? [1, 1, 1];
  return {
    material: readMaterial(glb, source.material),
    primitive: {
      position: readAccessor(glb, position),
      normal: read(source.attributes.NORMAL),
      uv: read(source.attributes.TEXCOORD_0),
      color: read(source.attributes.COLOR_0),
      indices: read(source.indices),
      owners: read(source.extras?.owners),
      translation: [tx, ty, tz],
      scale: [sx, sy, sz],
    },
  };
}

/** The vertices that some ranges of triangles use, each once, and the triangles over them. */
function collect(
  { position, indices, owners }: Primitive,
  ranges: readonly [number, number][],
  copies: readonly number[],
): Pick<Piece, 'vertices' | 'corners' | 'owners'> {
  const total = ranges.reduce((sum, [, triangles]) => sum + triangles, 0);
  const available = (indices?.count ?? position.count) / 3;
  const corners = new Uint32Array(3 * total);
  const whose = new Int32Array(total).fill(-1);
  const renumbered = new Int32Array(position.count).fill(-1);
  const vertices: number[] = [];
  let at = 0;
  for (const [first, triangles] of ranges) {
    if (first < 0 || first + triangles > available) {
      throw new FarfieldError(
        'format',
        'A cell lists triangles that its near block does not have.',
      );
    }
    for (let n = first; owners !== undefined && n < first + triangles; n++) {
      const owner = n < owners.count ? owners.data[n * owners.stride] : Infinity;
      if (owner > copies.length) {
        throw new FarfieldError('format', 'A triangle of a near block is part of no copy.');
      }
      if (owner > 0) whose[at / 3 + n - first] = copies[owner - 1];
    }
    for (let n = 3 * first; n < 3 * (first + triangles); n++) {
      const vertex = indices === undefined ? n : indices.data[n * indices.stride];
      if (vertex >= position.count) {
        throw new FarfieldError('format', 'A triangle of a near block has a vertex too many.');
      }
      if (renumbered[vertex] < 0) {
        renumbered[vertex] = vertices.length;
        vertices.push(vertex);
      }
      corners[at++] = renumbered[vertex];
    }
  }
  return { vertices: Uint32Array.from(vertices), corners, owners: whose };
}

function merge(pieces: readonly Piece[], centre: Vec3, owned: boolean): NearBatch {
  const { state } = pieces[0].material;
  const textured = state.map !== undefined || state.emissiveMap !== undefined;
  const count = pieces.reduce((sum, piece) => sum + piece.vertices.length, 0);
  const corners = pieces.reduce((sum, piece) => sum + piece.corners.length, 0);
  const batch: NearBatch = {
    state,
    positions: new Float32Array(3 * count),
    normals: new Int8Array(4 * count),
    uvs: new Float32Array(textured ? 2 * count : 0),
    colors: new Uint16Array(4 * count),
    indices: new Uint32Array(corners),
    owners: new Int32Array(owned ? corners / 3 : 0),
  };
  let firstVertex = 0;
  let firstCorner = 0;
  for (const piece of pieces) {
    copyVertices(batch, piece, firstVertex, centre);
    for (let n = 0; n < piece.corners.length; n++) {
      batch.indices[firstCorner + n] = firstVertex + piece.corners[n];
    }
    if (owned) batch.owners.set(piece.owners, firstCorner / 3);
    firstVertex += piece.vertices.length;
    firstCorner += piece.corners.length;
  }
  sortByDistance(batch);
  return batch;
}

/**
 * Order triangles by their nearest corner's distance from the cell's centre. From anywhere in the
 * cell this is nearly front to back, so most hidden pixels are never shaded: near polygons cost
 * their pixels, not their number (measured: 30 % less time where they fill the picture).
 */
function sortByDistance({ positions, indices, owners }: NearBatch): void {
  const count = indices.length / 3;
  const distances = new Float32Array(count);
  for (let t = 0; t < count; t++) {
    let nearest = Infinity;
    for (let n = 3 * t; n < 3 * t + 3; n++) {
      const v = 3 * indices[n];
      nearest = Math.min(
        nearest,
        positions[v] ** 2 + positions[v + 1] ** 2 + positions[v + 2] ** 2,
      );
    }
    distances[t] = nearest;
  }
  const order = Uint32Array.from({ length: count }, (_, t) => t);
  order.sort((a, b) => distances[a] - distances[b] || a - b);
  const sorted = new Uint32Array(indices.length);
  for (let n = 0; n < count; n++) {
    sorted.set(indices.subarray(3 * order[n], 3 * order[n] + 3), 3 * n);
  }
  indices.set(sorted);
  if (owners.length > 0) owners.set(Int32Array.from(order, (t) => owners[t]));
}

/** Squared distance of the triangle in the middle of a sorted batch. */
function middle({ positions, indices }: NearBatch): number {
  if (indices.length === 0) return 0;
  const v = 3 * indices[3 * Math.floor(indices.length / 6)];
  return positions[v] ** 2 + positions[v + 1] ** 2 + positions[v + 2] ** 2;
}

function copyVertices(batch: NearBatch, piece: Piece, first: number, centre: Vec3): void {
  const { primitive, material, vertices } = piece;
  const { position, normal, uv, color, translation, scale } = primitive;
  const [m00, m01, m02, m10, m11, m12] = material.uvTransform;
  for (let n = 0; n < vertices.length; n++) {
    const source = vertices[n];
    const target = first + n;
    for (let axis = 0; axis < 3; axis++) {
      const stored = position.data[source * position.stride + axis] * position.scale;
      batch.positions[3 * target + axis] = translation[axis] - centre[axis] + scale[axis] * stored;
      if (normal !== undefined) {
        const value = normal.data[source * normal.stride + axis] * normal.scale;
        batch.normals[4 * target + axis] = Math.round(127 * value);
      }
    }
    if (uv !== undefined && batch.uvs.length > 0) {
      const s = uv.data[source * uv.stride] * uv.scale;
      const t = uv.data[source * uv.stride + 1] * uv.scale;
      batch.uvs[2 * target] = m00 * s + m01 * t + m02;
      batch.uvs[2 * target + 1] = m10 * s + m11 * t + m12;
    }
    for (let c = 0; c < 4; c++) {
      const stored =
        color === undefined || c >= color.components
          ? 1
          : color.data[source * color.stride + c] * color.scale;
      const value = Math.min(1, stored * material.factor[c]);
      batch.colors[4 * target + c] = Math.round(65535 * value);
    }
  }
}
