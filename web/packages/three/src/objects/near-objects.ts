/**
 * The objects of a cell's near field, so that they can be drawn as impostors one by one. All of them
 * share the cell's buffers; only the order of the indices is another.
 */

import type { FoundObjects } from '@farfield/core';
import { BufferAttribute, BufferGeometry, Box3, Group, Mesh, Sphere, Vector3 } from 'three';
import type { CellView, WalkMesh } from '../cell-view.js';

export class NearObjects {
  /** One group of meshes for each object. */
  readonly objects: readonly Group[];
  private readonly view: CellView;
  private readonly group = new Group();

  constructor(view: CellView, found: FoundObjects) {
    this.view = view;
    this.group.name = 'farfield near objects';
    const sorted = found.batches.map(({ indices }) => new BufferAttribute(indices, 1));
    const part = (batch: number, first: number, count: number): WalkMesh => {
      const source = view.near[batch];
      const geometry = new BufferGeometry();
      for (const [name, attribute] of Object.entries(source.geometry.attributes)) {
        geometry.setAttribute(name, attribute);
      }
      geometry.setIndex(sorted[batch]);
      geometry.setDrawRange(first, count);
      const mesh = new Mesh(geometry, source.material);
      mesh.raycast = () => undefined;
      mesh.onBeforeRender = (...all) => source.onBeforeRender(...all);
      return mesh;
    };
    found.batches.forEach(({ rest }, batch) => {
      if (rest === 0) return;
      const mesh = part(batch, 0, rest);
      mesh.geometry.boundingSphere = new Sphere(undefined, Infinity);
      mesh.frustumCulled = false;
      this.group.add(mesh);
    });
    this.objects = found.objects.map(({ bounds, ranges }) => {
      const box = new Box3(new Vector3(...bounds.min), new Vector3(...bounds.max));
      const holder = new Group();
      for (const [batch, first, count] of ranges) {
        const mesh = part(batch, first, count);
        // Known already; computing them would read the vertices of the whole batch.
        mesh.geometry.boundingBox = box;
        mesh.geometry.boundingSphere = box.getBoundingSphere(new Sphere());
        holder.add(mesh);
      }
      this.group.add(holder);
      return holder;
    });
    this.group.visible = false;
    view.group.add(this.group);
  }

  /** Draw the objects one by one, or all near geometry at once as before. */
  set apart(apart: boolean) {
    this.group.visible = apart;
    for (const mesh of this.view.near) mesh.visible = !apart;
  }

  dispose(): void {
    this.apart = false;
    this.group.removeFromParent();
    this.group.traverse((object) => {
      if (object instanceof Mesh) (object as WalkMesh).geometry.dispose();
    });
  }
}
