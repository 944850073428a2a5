/**
 * Near geometry of one cell: the triangles its near blocks list, merged per draw state.
 *
 * Blocks share vertices between cells on disk; in memory each cell gets buffers of its own, so it
 * draws with one call per state however many blocks it touches, and its positions are relative to
 * its centre, where single precision is finest.
 */

import { FarfieldError } from './errors.js';
import type { Vec3 } from './format.js';
import { CopyList, type Copy } from './objects/copies.js';
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
 * Merges the listed triangles of near blocks, which come one at a time: of each only what is listed is
 * kept, so a near field of any number of blocks needs memory for what it draws and one block.
 */
export class NearBuild {
  /** What the batches' owners are numbers of. */
  readonly copies: readonly Copy[];
  private readonly centre: Vec3;
  private readonly list = new CopyList();
  private readonly groups = new Map<string, NearBatch[]>();

  /** @param centre what positions are relative to */
  constructor(centre: Vec3) {
    this.centre = centre;
    this.copies = this.list.copies;
  }

  /** Take the listed triangles of a block; throws FarfieldError 'format'. */
  add({ bytes, ranges }: NearSource): void {
    const glb = parseGlb(bytes);
    const copies = this.list.add(glb);
    const perPrimitive = new Map<number, [number, number][]>();
    for (let n = 0; n + 2 < ranges.length; n += 3) {
      const wanted = perPrimitive.get(ranges[n]) ?? [];
      wanted.push([ranges[n + 1], ranges[n + 2]]);
      perPrimitive.set(ranges[n], wanted);
    }
    for (const [number, wanted] of perPrimitive) {
      const { primitive, material } = readPrimitive(glb, number);
      const key = stateKey(material.state);
      const pieces = this.groups.get(key) ?? [];
      pieces.push(cutOut(primitive, material, wanted, copies, this.centre));
      this.groups.set(key, pieces);
    }
  }

  /**
   * Batches, and triangles in them, in the order in which they are best drawn, the same for the same
   * blocks in the same order. Nothing can be added after that.
   */
  finish(): NearBatch[] {
    const batches: NearBatch[] = [];
    for (const [key, pieces] of this.groups) {
      batches.push(merge(pieces, this.copies.length > 0));
      this.groups.delete(key);
    }
    return batches.sort((a, b) => middle(a) - middle(b));
  }
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

/** Some ranges of a primitive's triangles with the vertices that they use, each once, and all owners. */
function cutOut(
  primitive: Primitive,
  material: NearMaterial,
  ranges: readonly [number, number][],
  copies: readonly number[],
  centre: Vec3,
): NearBatch {
  const { position, indices, owners } = primitive;
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
  const batch = emptyBatch(material.state, vertices.length, total, total);
  copyVertices(batch, primitive, material, vertices, centre);
  batch.indices.set(corners);
  batch.owners.set(whose);
  return batch;
}

function emptyBatch(
  state: NearState,
  vertices: number,
  triangles: number,
  owners: number,
): NearBatch {
  const textured = state.map !== undefined || state.emissiveMap !== undefined;
  return {
    state,
    positions: new Float32Array(3 * vertices),
    normals: new Int8Array(4 * vertices),
    uvs: new Float32Array(textured ? 2 * vertices : 0),
    colors: new Uint16Array(4 * vertices),
    indices: new Uint32Array(3 * triangles),
    owners: new Int32Array(owners),
  };
}

function merge(pieces: readonly NearBatch[], owned: boolean): NearBatch {
  const vertices = pieces.reduce((sum, { positions }) => sum + positions.length / 3, 0);
  const triangles = pieces.reduce((sum, { indices }) => sum + indices.length / 3, 0);
  const batch = emptyBatch(pieces[0].state, vertices, triangles, owned ? triangles : 0);
  let vertex = 0;
  let corner = 0;
  for (const piece of pieces) {
    batch.positions.set(piece.positions, 3 * vertex);
    batch.normals.set(piece.normals, 4 * vertex);
    batch.uvs.set(piece.uvs, piece.uvs.length > 0 ? 2 * vertex : 0);
    batch.colors.set(piece.colors, 4 * vertex);
    for (let n = 0; n < piece.indices.length; n++) {
      batch.indices[corner + n] = vertex + piece.indices[n];
    }
    if (owned) batch.owners.set(piece.owners, corner / 3);
    vertex += piece.positions.length / 3;
    corner += piece.indices.length;
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

function copyVertices(
  batch: NearBatch,
  { position, normal, uv, color, translation, scale }: Primitive,
  material: NearMaterial,
  vertices: readonly number[],
  centre: Vec3,
): void {
  const [m00, m01, m02, m10, m11, m12] = material.uvTransform;
  for (let n = 0; n < vertices.length; n++) {
    const source = vertices[n];
    for (let axis = 0; axis < 3; axis++) {
      const stored = position.data[source * position.stride + axis] * position.scale;
      batch.positions[3 * n + axis] = translation[axis] - centre[axis] + scale[axis] * stored;
      if (normal !== undefined) {
        const value = normal.data[source * normal.stride + axis] * normal.scale;
        batch.normals[4 * n + axis] = Math.round(127 * value);
      }
    }
    if (uv !== undefined && batch.uvs.length > 0) {
      const s = uv.data[source * uv.stride] * uv.scale;
      const t = uv.data[source * uv.stride + 1] * uv.scale;
      batch.uvs[2 * n] = m00 * s + m01 * t + m02;
      batch.uvs[2 * n + 1] = m10 * s + m11 * t + m12;
    }
    for (let c = 0; c < 4; c++) {
      const stored =
        color === undefined || c >= color.components
          ? 1
          : color.data[source * color.stride + c] * color.scale;
      const value = Math.min(1, stored * material.factor[c]);
      batch.colors[4 * n + c] = Math.round(65535 * value);
    }
  }
}
