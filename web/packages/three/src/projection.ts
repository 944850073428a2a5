/**
 * Clip space without a far plane. A quad's corner may be infinitely far, and WebGL 2 has no depth
 * clamp, so depth is computed from the near plane alone, for far quads and near polygons alike.
 */

import type { PerspectiveCamera } from 'three';

export const CLIP_GLSL = `
// Eye-space homogeneous position -> clip space. At infinity depth stays just short of the cleared
// value, so that "less than" still draws there.
vec4 ff_clip(mat4 projection, vec4 view) {
  vec4 clip = projection * view;
  float near = projection[3][2] / (projection[2][2] - 1.0);
  clip.z = -0.999999 * view.z - 2.0 * near * view.w;
  return clip;
}
`;

/**
 * Give a camera the projection that walks use, so that depths of your own objects compare exactly
 * with the walk's. Call it after `updateProjectionMatrix`. Without it they agree well before the
 * camera's far plane, and objects beyond that are clipped.
 */
export function setInfiniteFar(camera: PerspectiveCamera): void {
  const { elements } = camera.projectionMatrix;
  elements[10] = -0.999999;
  elements[14] = -2 * camera.near;
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}
