/** The box of an object in its own space, without its scale, and what drawing it costs. */

import { pictureCost, type Bounds } from '@farfield/core';
import { Box3, Matrix4, Mesh, SkinnedMesh, type Object3D } from 'three';
import { rigidPose } from './picture-taker.js';

/** Vertices may leave the box of a mesh that is moved by morph targets; it is grown by this share. */
const MORPH_GROWTH = 0.25;

/**
 * The box around all meshes below `object`, skins as their bones stand now; undefined if nothing has
 * extent. World matrices must be current.
 */
export function objectBounds(object: Object3D): Bounds | undefined {
  const toOwn = rigidPose(object).invert();
  const whole = new Box3();
  const relative = new Matrix4();
  object.traverse((child) => {
    if (!(child instanceof Mesh)) return;
    const mesh: Mesh = child as Mesh;
    const { geometry } = mesh;
    let box: Box3 | null;
    if (mesh instanceof SkinnedMesh) {
      mesh.skeleton.update();
      mesh.computeBoundingBox();
      box = mesh.boundingBox;
    } else {
      if (geometry.boundingBox === null) geometry.computeBoundingBox();
      box = geometry.boundingBox;
    }
    if (box === null || box.isEmpty()) return;
    const own = box.clone().applyMatrix4(relative.multiplyMatrices(toOwn, mesh.matrixWorld));
    if (Object.keys(geometry.morphAttributes).length > 0) {
      const { min, max } = own;
      own.expandByScalar(MORPH_GROWTH * min.distanceTo(max));
    }
    whole.union(own);
  });
  if (whole.isEmpty()) return undefined;
  // A flat object has no inside, but its billboard needs a size.
  whole.expandByScalar(1e-3 * whole.min.distanceTo(whole.max) + 1e-6);
  return { min: whole.min.toArray(), max: whole.max.toArray() };
}

/** What a picture of `object` costs. */
export function objectCost(object: Object3D): number {
  let [triangles, calls] = [0, 0];
  object.traverse((child) => {
    if (!(child instanceof Mesh)) return;
    const { geometry, material } = child as Mesh;
    const corners = geometry.index?.count ?? geometry.attributes.position.count;
    triangles += Math.min(corners, geometry.drawRange.count) / 3;
    calls += Array.isArray(material) ? material.length : 1;
  });
  return pictureCost(triangles, calls);
}
