import {
  InlineBuilder,
  Solid,
  buildSolid,
  findObjects,
  sortBySector,
  type NearBatch,
  type NearState,
} from '@farfield/core';
import {
  BoxGeometry,
  BufferAttribute,
  type BufferGeometry,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  RawShaderMaterial,
  Vector3,
} from 'three';
import { describe, expect, test } from 'vitest';
import { CellView } from '../src/cell-view.js';
import { objectBounds } from '../src/objects/bounds.js';
import { NearObjects } from '../src/objects/near-objects.js';
import { rigidPose } from '../src/objects/picture-taker.js';

const STATE: NearState = {
  map: undefined,
  emissiveMap: undefined,
  emissive: [0, 0, 0],
  alpha: 'opaque',
  cutoff: 0.5,
  doubleSided: false,
  unlit: false,
};

/** Boxes of 12 triangles at some places, as one batch. */
function batchOf(places: readonly number[]): NearBatch {
  const box = new BoxGeometry(1, 1, 1);
  const corner = box.getAttribute('position').array;
  const positions: number[] = [];
  const indices: number[] = [];
  places.forEach((x, n) => {
    for (let v = 0; v < corner.length; v += 3) {
      positions.push(corner[v] + x, corner[v + 1], corner[v + 2]);
    }
    for (const index of box.index?.array ?? []) indices.push(index + (n * corner.length) / 3);
  });
  const vertices = positions.length / 3;
  return {
    state: STATE,
    positions: Float32Array.from(positions),
    normals: new Int8Array(4 * vertices),
    uvs: new Float32Array(0),
    colors: new Uint16Array(4 * vertices),
    indices: Uint32Array.from(indices),
    owners: new Int32Array(0),
  };
}

function viewOf(batches: NearBatch[]): CellView {
  const far = { quads: 0, positions: new Float32Array(0), texels: new Float32Array(0) };
  const sectors = sortBySector(far.positions, new Uint32Array(0));
  const cell = { centre: [5, 0, 0] as const, far, sectors, atlases: [], near: [] };
  const material = new RawShaderMaterial();
  const materials = batches.map(() => material);
  const solid = new Solid(buildSolid([], [1, 2, 3], [8, 8, 8]));
  return new CellView(cell, [], material, batches, materials, solid, () => undefined);
}

describe('NearObjects', () => {
  test('draws apart exactly what the near field holds, and whole again after', async () => {
    const batches = [batchOf([0, 4, 30]), batchOf([0.2, 8])];
    const view = viewOf(batches);
    view.group.visible = true;
    const options = { nearField: 20, largest: 5, fewest: 1 };
    const found = await new InlineBuilder().objects(batches, options);
    expect(found).toEqual(findObjects(batches, options));
    const objects = new NearObjects(view, found);
    expect(objects.objects).toHaveLength(3);
    const drawn = (): number => {
      let corners = 0;
      view.group.traverseVisible((child) => {
        if (!(child instanceof Mesh)) return;
        const { geometry } = child as Mesh;
        const all = geometry.index?.count ?? 0;
        corners += Math.min(all, geometry.drawRange.count);
      });
      return corners / 3;
    };
    expect(drawn()).toBe(60);
    objects.apart = true;
    expect(drawn()).toBe(60);
    objects.objects[0].visible = false; // the two boxes that share most of their space
    expect(drawn()).toBe(36);
    objects.apart = false;
    expect(drawn()).toBe(60);
    objects.apart = true;
    objects.dispose();
    expect(drawn()).toBe(60);
  });

  test('shares the buffers of the cell', () => {
    const batches = [batchOf([0, 4])];
    const view = viewOf(batches);
    const objects = new NearObjects(
      view,
      findObjects(batches, { nearField: 9, largest: 5, fewest: 1 }),
    );
    for (const holder of objects.objects) {
      for (const child of holder.children) {
        const { geometry } = child as unknown as { geometry: BufferGeometry };
        expect(geometry.getAttribute('position')).toBe(
          view.near[0].geometry.getAttribute('position'),
        );
        expect(geometry.boundingSphere?.radius).toBeCloseTo(Math.sqrt(3) / 2, 6);
      }
    }
  });
});

describe('objectBounds', () => {
  test('is the box in the own space, whatever place, turn and size', () => {
    const object = new Group();
    const mesh = new Mesh(new BoxGeometry(2, 4, 6), new MeshBasicMaterial());
    mesh.position.set(0, 2, 0);
    object.add(mesh);
    object.position.set(10, -3, 7);
    object.rotation.set(0.3, 1, -0.4);
    object.scale.setScalar(2);
    object.updateMatrixWorld(true);
    const bounds = objectBounds(object);
    [-2, 0, -6].forEach((low, axis) => expect(bounds?.min[axis]).toBeCloseTo(low, 1));
    [2, 8, 6].forEach((high, axis) => expect(bounds?.max[axis]).toBeCloseTo(high, 1));
    expect(objectBounds(new Group())).toBeUndefined();
  });

  test('leaves room for what morph targets move', () => {
    const mesh = new Mesh(new BoxGeometry(1, 1, 1), new MeshBasicMaterial());
    const still = objectBounds(mesh);
    mesh.geometry.morphAttributes.position = [new BufferAttribute(new Float32Array(72), 3)];
    expect(objectBounds(mesh)?.max[0]).toBeGreaterThan((still?.max[0] ?? 0) + 0.1);
  });
});

test('rigidPose is place and turn alone', () => {
  const object = new Group();
  object.position.set(1, 2, 3);
  object.rotation.set(0.1, 0.2, 0.3);
  object.scale.set(2, 2, 2);
  object.updateMatrixWorld();
  const [place, turn, size] = [new Vector3(), new Quaternion(), new Vector3()];
  new Matrix4().copy(rigidPose(object)).decompose(place, turn, size);
  expect(place.toArray()).toEqual([1, 2, 3]);
  expect(turn.angleTo(object.quaternion)).toBeCloseTo(0, 6);
  size.toArray().forEach((s) => expect(s).toBeCloseTo(1, 6));
});
