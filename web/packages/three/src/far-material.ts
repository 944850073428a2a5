/** Draws all quads of a cell: homogeneous vertices, pages in one texture array, colours as stored. */

import {
  GLSL3,
  LessDepth,
  DoubleSide,
  RawShaderMaterial,
  type DataArrayTexture,
  type IUniform,
} from 'three';
import { PAGES } from '@farfield/core';
import { FADE_GLSL } from './fade.js';
import { CLIP_GLSL } from './projection.js';

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec4 position;
in vec3 texel;
out vec2 v_texel;
flat out int v_slot;
flat out int v_one_sided;
#ifdef TINT
flat out vec3 v_tint;
#endif
${CLIP_GLSL}
void main() {
  v_texel = texel.xy;
  v_one_sided = texel.z < 0.0 ? 1 : 0;
  int code = int(texel.z < 0.0 ? -1.0 - texel.z : texel.z);
  v_slot = code % ${PAGES};
#ifdef TINT
  // TINT 1: by quad. TINT 2: by layer, whose disparity all its corners have.
  float key = TINT == 1 ? 2.39996 * float(code / ${PAGES}) : 60.0 * log(max(position.w, 1e-7));
  v_tint = 0.5 + 0.5 * cos(key + vec3(0.0, 2.1, 4.2));
#endif
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
flat in int v_one_sided;
#ifdef TINT
flat in vec3 v_tint;
#endif
out vec4 color;
${FADE_GLSL}
void main() {
  // a plane between this eye and the quad's own shows no picture of its other side
  if (v_one_sided != 0 && !gl_FrontFacing) discard;
#ifdef FADE
  if (ff_faded()) discard;
#endif
  vec4 texel = texelFetch(ff_pages, ivec3(floor(v_texel), v_slot), 0);
  if (texel.a < 0.5) discard;
  color = vec4(texel.rgb, 1.0);
#ifdef TINT
  color.rgb = mix(color.rgb, v_tint, 0.55);
#endif
}
`;

/** Pages to sample, the fade of the cell that is drawn next, and whether cells ever fade. */
export function createFarMaterial(
  pages: DataArrayTexture,
  fade: IUniform<number>,
  fades: boolean,
): RawShaderMaterial {
  return new RawShaderMaterial({
    name: 'farfield far',
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    defines: fades ? { FADE: '' } : {},
    uniforms: { ff_pages: { value: pages }, ff_fade: fade },
    side: DoubleSide,
    depthFunc: LessDepth,
    toneMapped: false,
  });
}

/** The number of the quad that a vertex belongs to, from its third texel coordinate. */
export function quadOf(code: number): number {
  return Math.floor((code < 0 ? -1 - code : code) / PAGES);
}
