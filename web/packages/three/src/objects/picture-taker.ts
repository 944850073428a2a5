/**
 * Takes the pictures of one frame: one change of the render target for all of them, each object
 * through a frustum that its billboard fills exactly.
 */

import { type Frame, type Slot } from '@farfield/core';
import {
  Color,
  DirectionalLight,
  Light,
  Matrix4,
  PerspectiveCamera,
  Quaternion,
  Scene,
  SpotLight,
  Vector3,
  type Object3D,
  type WebGLRenderer,
} from 'three';
import type { AtlasTarget } from './atlas-target.js';

export interface Order {
  readonly object: Object3D;
  /** In the space of `pose`. */
  readonly frame: Frame;
  /** The object's space without its scale, in world space. */
  readonly pose: Matrix4;
  readonly slot: Slot;
  /** See `pictureCost`. */
  readonly cost: number;
}

/** Where the near plane lies between the eye and the box. */
const NEAR = 0.98;

export class PictureTaker {
  private readonly renderer: WebGLRenderer;
  private readonly atlas: AtlasTarget;
  private readonly camera = new PerspectiveCamera();
  /** Has neither background nor fog: fog belongs on the billboard, where its distance is known. */
  private readonly scene = new Scene();

  constructor(renderer: WebGLRenderer, atlas: AtlasTarget) {
    this.renderer = renderer;
    this.atlas = atlas;
    this.camera.matrixAutoUpdate = false;
    this.camera.matrixWorldAutoUpdate = false;
    this.camera.layers.enableAll();
    this.scene.matrixWorldAutoUpdate = false;
  }

  /** Take pictures, lit by the lights below `root`. */
  take(orders: readonly Order[], root: Object3D): void {
    if (orders.length === 0) return;
    const { renderer, scene, camera, atlas } = this;
    const lights: Object3D[] = [];
    root.traverseVisible((object) => {
      if (!(object instanceof Light)) return;
      // Pictures may be taken before the frame that first brings the scene's matrices up to date.
      object.updateWorldMatrix(true, false);
      if (object instanceof DirectionalLight || object instanceof SpotLight) {
        object.target.updateWorldMatrix(true, false);
      }
      lights.push(object);
    });
    scene.environment = root instanceof Scene ? root.environment : null;
    const restore = quieten(renderer);
    for (const { object, frame, pose, slot } of orders) {
      object.updateWorldMatrix(true, true);
      // The objects keep their parents: children are only looked at while drawing.
      scene.children = [...lights, object];
      place(camera, frame, pose);
      atlas.aim(slot);
      renderer.setRenderTarget(atlas.target);
      renderer.render(scene, camera);
    }
    scene.children = [];
    restore();
  }
}

/** Put the camera at the frame's eye and its frustum around the frame's rectangle. */
function place(camera: PerspectiveCamera, frame: Frame, pose: Matrix4): void {
  const { right, up, forward } = frame.basis;
  camera.matrixWorld
    .makeBasis(new Vector3(...right), new Vector3(...up), new Vector3(...forward).negate())
    .setPosition(new Vector3(...frame.eye))
    .premultiply(pose);
  camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
  const near = NEAR * frame.near;
  camera.near = near;
  camera.far = 1.02 * frame.far;
  camera.projectionMatrix.makePerspective(
    near * frame.left,
    near * frame.rightmost,
    near * frame.top,
    near * frame.bottom,
    near,
    camera.far,
  );
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}

/** Set the renderer up for pictures; returns what puts everything back. */
function quieten(renderer: WebGLRenderer): () => void {
  const target = renderer.getRenderTarget();
  const colour = renderer.getClearColor(new Color());
  const alpha = renderer.getClearAlpha();
  const { autoClear, xr, shadowMap, info } = renderer;
  const before = {
    xr: xr.enabled,
    shadows: [shadowMap.autoUpdate, shadowMap.needsUpdate] as const,
    reset: info.autoReset,
  };
  renderer.setClearColor(0x000000, 0);
  renderer.autoClear = true;
  xr.enabled = false;
  shadowMap.autoUpdate = false;
  shadowMap.needsUpdate = false;
  info.autoReset = false;
  return () => {
    renderer.setRenderTarget(target);
    renderer.setClearColor(colour, alpha);
    renderer.autoClear = autoClear;
    xr.enabled = before.xr;
    [shadowMap.autoUpdate, shadowMap.needsUpdate] = before.shadows;
    info.autoReset = before.reset;
  };
}

/** The object's place and turn in world space, without its scale. */
export function rigidPose(object: Object3D, target = new Matrix4()): Matrix4 {
  const [position, turn, size] = [new Vector3(), new Quaternion(), new Vector3()];
  object.matrixWorld.decompose(position, turn, size);
  return target.compose(position, turn, size.set(1, 1, 1));
}
