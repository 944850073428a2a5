/** Draws all quads of a cell: homogeneous vertices, pages in one texture array, colours as stored. */

import { GLSL3, LessDepth, DoubleSide, RawShaderMaterial, type DataArrayTexture } from 'three';
import { CLIP_GLSL } from './projection.js';

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec4 position;
in vec3 texel;
out vec2 v_texel;
flat out int v_slot;
${CLIP_GLSL}
void main() {
  v_texel = texel.xy;
  v_slot = int(texel.z);
  gl_Position = ff_clip(projectionMatrix, modelViewMatrix * position);
}
`;

const FRAGMENT = `
precision highp float;
precision highp int;
precision highp sampler2DArray;
uniform sampler2DArray ff_pages;
in vec2 v_texel;
flat in int v_slot;
out vec4 color;
void main() {
  vec4 texel = texelFetch(ff_pages, ivec3(floor(v_texel), v_slot), 0);
  if (texel.a < 0.5) discard;
  color = vec4(texel.rgb, 1.0);
}
`;

export function createFarMaterial(pages: DataArrayTexture): RawShaderMaterial {
  return new RawShaderMaterial({
    name: 'farfield far',
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { ff_pages: { value: pages } },
    side: DoubleSide,
    depthFunc: LessDepth,
    toneMapped: false,
  });
}
