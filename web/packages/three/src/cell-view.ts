/** One complete cell as three.js objects: two meshes for all far quads, one per near draw state. */

import {
  PAGES,
  visibleRange,
  type BuiltCell,
  type NearBatch,
  type Sectors,
  type Solid,
} from '@farfield/core';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Matrix4,
  Mesh,
  Sphere,
  type Camera,
  type RawShaderMaterial,
} from 'three';
import type { CellCopies } from './objects/cell-copies.js';

/** Mesh of a cell. */
export type WalkMesh = Mesh<BufferGeometry, RawShaderMaterial>;

export class CellView {
  readonly group = new Group();
  /** Far triangles in the directions that a camera sees. */
  readonly far: WalkMesh | undefined;
  /** Far triangles that lie in too many directions to choose from; its buffers are `far`'s. */
  readonly wide: WalkMesh | undefined;
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
  private readonly sectors: Sectors;
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
    this.sectors = cell.sectors;
    this.quads = cell.far.quads;
    this.group.name = 'farfield cell';
    this.group.position.set(...cell.centre);
    this.group.visible = false;
    // In the order of the batches, nearest first, whatever their materials.
    this.near = batches.map((batch, n) =>
      mesh(nearGeometry(batch), nearMaterials[n], n / batches.length),
    );
    if (this.quads > 0) {
      const geometry = farGeometry(cell, slots);
      this.far = mesh(geometry, farMaterial, 1.01);
      if (cell.sectors.wide > 0)
        this.wide = mesh(part(geometry, cell.sectors.wide), farMaterial, 1);
    }
    for (const object of [...this.near, ...this.farMeshes]) this.group.add(object);
    if (copies !== undefined) this.group.add(...copies.meshes);
    this.nearTriangles = batches.reduce((sum, { indices }) => sum + indices.length / 3, 0);
    this.bytes = this.geometries.reduce((sum, geometry) => sum + geometryBytes(geometry), 0);
  }

  /** What far quads are drawn with. */
  get farMeshes(): WalkMesh[] {
    return [this.wide, this.far].filter((object) => object !== undefined);
  }

  /** Have only those far triangles drawn that a camera may see. */
  aim(camera: Camera): void {
    if (this.far === undefined) return;
    matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const { elements } = matrix.multiply(this.far.matrixWorld);
    const { start, count } = visibleRange(this.sectors, elements);
    this.far.geometry.setDrawRange(start, count);
  }

  /** All buffers, each once. */
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
    this.wide?.geometry.dispose();
    this.copies?.dispose();
    this.release();
  }
}

const matrix = new Matrix4();

function mesh(geometry: BufferGeometry, material: RawShaderMaterial, order: number): WalkMesh {
  // Computing bounds would read every vertex; a cell is always in view.
  geometry.boundingSphere = new Sphere(undefined, Infinity);
  const object = new Mesh(geometry, material);
  object.frustumCulled = false;
  object.renderOrder = order;
  object.raycast = () => undefined;
  return object;
}

/** The first `count` corners of a geometry, over the same buffers. */
function part(whole: BufferGeometry, count: number): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const [name, attribute] of Object.entries(whole.attributes)) {
    geometry.setAttribute(name, attribute);
  }
  geometry.setIndex(whole.index);
  geometry.setDrawRange(0, count);
  return geometry;
}

function farGeometry({ far, sectors }: BuiltCell, slots: readonly number[]): BufferGeometry {
  const { texels } = far;
  for (let n = 2; n < texels.length; n += 3) {
    const page = texels[n] % PAGES;
    texels[n] += slots[page] - page;
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(far.positions, 4));
  geometry.setAttribute('texel', new BufferAttribute(texels, 3));
  geometry.setIndex(new BufferAttribute(sectors.indices, 1));
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
