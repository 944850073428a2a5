/** The light model's sky behind everything: one triangle at the far end of the depth range. */

import type { Light } from '@farfield/core';
import {
  BufferAttribute,
  BufferGeometry,
  GLSL3,
  LessEqualDepth,
  Mesh,
  RawShaderMaterial,
  type IUniform,
} from 'three';
import { lightGlsl } from './light.js';

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec3 position;
out vec3 v_direction;
void main() {
  mat4 p = projectionMatrix;
  vec3 view = vec3((position.x + p[2][0]) / p[0][0], (position.y + p[2][1]) / p[1][1], -1.0);
  v_direction = view * mat3(modelViewMatrix);
  gl_Position = vec4(position.xy, 1.0, 1.0);
}
`;

const fragment = (light: Light): string => `
precision highp float;
precision highp int;
uniform float ff_alpha;
in vec3 v_direction;
out vec4 color;
${lightGlsl(light)}
void main() {
  color = vec4(ff_to_srgb(ff_sky(v_direction)), ff_alpha);
}
`;

export type Sky = Mesh<BufferGeometry, RawShaderMaterial>;

/** The background; `alpha` is written as the canvas's alpha, so 0 marks background pixels. */
export function createSky(light: Light, alpha: IUniform<number>): Sky {
  const geometry = new BufferGeometry();
  const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
  geometry.setAttribute('position', new BufferAttribute(corners, 3));
  const material = new RawShaderMaterial({
    name: 'farfield sky',
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: fragment(light),
    uniforms: { ff_alpha: alpha },
    depthFunc: LessEqualDepth,
    depthWrite: false,
    toneMapped: false,
  });
  const sky = new Mesh(geometry, material);
  sky.name = 'farfield sky';
  sky.frustumCulled = false;
  sky.renderOrder = 2;
  sky.raycast = () => undefined;
  return sky;
}
