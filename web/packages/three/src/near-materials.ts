/** Draws near polygons with the baker's light model, clipped a little outside their cell's near field. */

import { NEAR_OVERLAP, stateKey, type NearState } from '@farfield/core';
import {
  DoubleSide,
  FrontSide,
  GLSL3,
  LessDepth,
  RawShaderMaterial,
  Vector3,
  type IUniform,
  type Texture,
} from 'three';
import { FADE_GLSL } from './fade.js';
import type { Uniforms } from './light.js';
import { CLIP_GLSL } from './projection.js';
import { LIGHT_GLSL } from './shading.generated.js';

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec3 position;
in vec4 normal;
in vec4 color;
out vec3 v_local;
out vec3 v_normal;
out vec4 v_color;
#if defined(MAP) || defined(EMISSIVE_MAP)
in vec2 uv;
out vec2 v_uv;
#endif
${CLIP_GLSL}
void main() {
  v_local = position;
  v_normal = normal.xyz;
  v_color = color;
#if defined(MAP) || defined(EMISSIVE_MAP)
  v_uv = uv;
#endif
  gl_Position = ff_clip(projectionMatrix, modelViewMatrix * vec4(position, 1.0));
}
`;

const FRAGMENT = `
precision highp float;
precision highp int;
uniform float ff_near_field;
uniform float ff_top;
uniform vec3 ff_emissive;
uniform float ff_unlit;
uniform float ff_cutoff;
in vec3 v_local;
in vec3 v_normal;
in vec4 v_color;
#if defined(MAP) || defined(EMISSIVE_MAP)
in vec2 v_uv;
#endif
#ifdef MAP
uniform sampler2D ff_map;
#endif
#ifdef EMISSIVE_MAP
uniform sampler2D ff_emissive_map;
#endif
out vec4 color;
${LIGHT_GLSL}
${FADE_GLSL}
void main() {
  if (ff_faded()) discard;
  vec4 base = v_color;
  vec3 emissive = ff_emissive;
#ifdef MAP
  base *= texture(ff_map, v_uv);
#endif
#ifdef EMISSIVE_MAP
  emissive *= texture(ff_emissive_map, v_uv).rgb;
#endif
  vec3 far = abs(v_local);
  if (max(far.x, max(far.y, far.z)) > ff_near_field) discard;
#ifdef MASK
  if (base.a < ff_cutoff) discard;
#endif
#ifdef DITHER
  // Pixels are counted from the top left, as in the baker.
  if (!ff_dither(base.a, vec2(gl_FragCoord.x, ff_top - gl_FragCoord.y))) discard;
#endif
  vec3 n = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  color = vec4(ff_to_srgb(ff_shade(base.rgb, n, emissive, ff_unlit)), 1.0);
}
`;

/** One material per draw state, kept for the life of the walk: a program is compiled only once. */
export class NearMaterials {
  /** Top edge of the viewport in gl_FragCoord's terms. */
  readonly top: IUniform<number> = { value: 0 };
  /** Of the cell that is drawn next. */
  readonly fade: IUniform<number> = { value: 0 };
  readonly light: Uniforms;
  private readonly shared: Uniforms;
  private readonly materials = new Map<string, RawShaderMaterial>();

  constructor(light: Uniforms, nearField: number) {
    this.light = light;
    this.shared = {
      ...light,
      ff_near_field: { value: NEAR_OVERLAP * nearField },
      ff_top: this.top,
      ff_fade: this.fade,
    };
  }

  /** The material of a state, drawing with these textures. */
  get(state: NearState, map?: Texture, emissiveMap?: Texture): RawShaderMaterial {
    const key = stateKey(state);
    let material = this.materials.get(key);
    if (material === undefined) {
      material = this.create(state);
      this.materials.set(key, material);
    }
    // A texture that was dropped and loaded again is a new object; no cell uses the old one then.
    if (map !== undefined) material.uniforms.ff_map.value = map;
    if (emissiveMap !== undefined) material.uniforms.ff_emissive_map.value = emissiveMap;
    return material;
  }

  dispose(): void {
    for (const material of this.materials.values()) material.dispose();
    this.materials.clear();
  }

  private create(state: NearState): RawShaderMaterial {
    const defines: Record<string, string> = {};
    if (state.map !== undefined) defines.MAP = '';
    if (state.emissiveMap !== undefined) defines.EMISSIVE_MAP = '';
    if (state.alpha === 'mask') defines.MASK = '';
    if (state.alpha === 'dither') defines.DITHER = '';
    return new RawShaderMaterial({
      name: 'farfield near',
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      defines,
      uniforms: {
        ...this.shared,
        ff_emissive: { value: new Vector3(...state.emissive) },
        ff_unlit: { value: state.unlit ? 1 : 0 },
        ff_cutoff: { value: state.cutoff },
        ff_map: { value: null },
        ff_emissive_map: { value: null },
      },
      side: state.doubleSided ? DoubleSide : FrontSide,
      depthFunc: LessDepth,
      toneMapped: false,
    });
  }
}
