/** One complete cell as three.js objects: one mesh for all far quads, one per near draw state. */

import { PAGES, type BuiltCell, type NearBatch, type Solid } from '@farfield/core';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Mesh,
  Sphere,
  type RawShaderMaterial,
} from 'three';
import type { CellCopies } from './objects/cell-copies.js';

/** Mesh of a cell. */
export type WalkMesh = Mesh<BufferGeometry, RawShaderMaterial>;

export class CellView {
  readonly group = new Group();
  readonly far: WalkMesh | undefined;
  readonly near: readonly WalkMesh[];
  readonly quads: number;
  readonly nearTriangles: number;
  /** What a walker in the cell stands on and bumps into. */
  readonly solid: Solid;
  /** Bytes of all vertex and index buffers. */
  readonly bytes: number;
  /** Objects of the near field of which there are many. */
  readonly copies: CellCopies | undefined;
  /** Which pixels it is drawn at, see `FADE_GLSL`. */
  fade = 0;
  private readonly release: () => void;

  /**
   * @param slots slot in the page pool of each of the cell's pages
   * @param nearMaterials a material for each batch
   * @param solid the near field as obstacles
   * @param release called once, when the view is disposed of
   * @param copies what repeats among the batches
   */
  constructor(
    cell: BuiltCell,
    slots: readonly number[],
    farMaterial: RawShaderMaterial,
    batches: readonly NearBatch[],
    nearMaterials: readonly RawShaderMaterial[],
    solid: Solid,
    release: () => void,
    copies?: CellCopies,
  ) {
    this.copies = copies;
    this.release = release;
    this.solid = solid;
    this.quads = cell.far.quads;
    this.group.name = 'farfield cell';
    this.group.position.set(...cell.centre);
    this.group.visible = false;
    // In the order of the batches, nearest first, whatever their materials.
    this.near = batches.map((batch, n) =>
      mesh(nearGeometry(batch), nearMaterials[n], n / batches.length),
    );
    this.far = this.quads === 0 ? undefined : mesh(farGeometry(cell, slots), farMaterial, 1);
    for (const object of this.near) this.group.add(object);
    if (this.far !== undefined) this.group.add(this.far);
    if (copies !== undefined) this.group.add(...copies.meshes);
    this.nearTriangles = batches.reduce((sum, { indices }) => sum + indices.length / 3, 0);
    this.bytes = this.geometries.reduce((sum, geometry) => sum + geometryBytes(geometry), 0);
  }

  get geometries(): BufferGeometry[] {
    return [...this.near, ...(this.far === undefined ? [] : [this.far])].map(
      ({ geometry }) => geometry,
    );
  }

  /** What drawing the cell costs, in draw calls. */
  get drawCalls(): number {
    return this.group.children.filter(({ visible }) => visible).length;
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const geometry of this.geometries) geometry.dispose();
    this.copies?.dispose();
    this.release();
  }
}

function mesh(geometry: BufferGeometry, material: RawShaderMaterial, order: number): WalkMesh {
  // Computing bounds would read every vertex; a cell is always in view.
  geometry.boundingSphere = new Sphere(undefined, Infinity);
  const object = new Mesh(geometry, material);
  object.frustumCulled = false;
  object.renderOrder = order;
  object.raycast = () => undefined;
  return object;
}

function farGeometry({ far }: BuiltCell, slots: readonly number[]): BufferGeometry {
  const { texels } = far;
  for (let n = 2; n < texels.length; n += 3) {
    // one number of each kind, see QuadVertices
    const sign = texels[n] < 0 ? -1 : 1;
    const page = (sign < 0 ? -1 - texels[n] : texels[n]) % PAGES;
    texels[n] += sign * (slots[page] - page);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(far.positions, 4));
  geometry.setAttribute('texel', new BufferAttribute(texels, 3));
  geometry.setIndex(new BufferAttribute(far.indices, 1));
  return geometry;
}

function nearGeometry(batch: NearBatch): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(batch.positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(batch.normals, 4, true));
  geometry.setAttribute('color', new BufferAttribute(batch.colors, 4, true));
  if (batch.uvs.length > 0) geometry.setAttribute('uv', new BufferAttribute(batch.uvs, 2));
  geometry.setIndex(new BufferAttribute(batch.indices, 1));
  return geometry;
}

function geometryBytes({ attributes, index }: BufferGeometry): number {
  const buffers = Object.values(attributes) as BufferAttribute[];
  if (index !== null) buffers.push(index);
  return buffers.reduce((sum, { array }) => sum + array.byteLength, 0);
}
