/** Draws near polygons with the baker's light model, clipped a little outside their cell's near field. */

import { NEAR_OVERLAP, stateKey, type Light, type NearState } from '@farfield/core';
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
import { glslFloat, lightGlsl, type Uniforms } from './light.js';
import { CLIP_GLSL } from './projection.js';

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec3 position;
in vec4 normal;
in vec4 color;
#ifdef NEAR_FIELD
out vec3 v_local;
#endif
out vec3 v_normal;
out vec4 v_color;
#if defined(MAP) || defined(EMISSIVE_MAP)
in vec2 uv;
out vec2 v_uv;
#endif
${CLIP_GLSL}
void main() {
#ifdef NEAR_FIELD
  v_local = position;
#endif
  v_normal = normal.xyz;
  v_color = color;
#if defined(MAP) || defined(EMISSIVE_MAP)
  v_uv = uv;
#endif
  gl_Position = ff_clip(projectionMatrix, modelViewMatrix * vec4(position, 1.0));
}
`;

const fragment = (light: Light): string => `
precision highp float;
precision highp int;
uniform float ff_top;
uniform vec3 ff_emissive;
uniform float ff_cutoff;
#ifdef NEAR_FIELD
in vec3 v_local;
#endif
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
${lightGlsl(light)}
${FADE_GLSL}
void main() {
#ifdef FADE
  if (ff_faded()) discard;
#endif
  vec4 base = v_color;
#ifdef EMISSIVE
  vec3 emissive = ff_emissive;
#else
  const vec3 emissive = vec3(0.0);
#endif
#ifdef MAP
  base *= texture(ff_map, v_uv);
#endif
#ifdef EMISSIVE_MAP
  emissive *= texture(ff_emissive_map, v_uv).rgb;
#endif
#ifdef NEAR_FIELD
  vec3 far = abs(v_local);
  if (max(far.x, max(far.y, far.z)) > NEAR_FIELD) discard;
#endif
#ifdef MASK
  if (base.a < ff_cutoff) discard;
#endif
#ifdef DITHER
  // Pixels are counted from the top left, as in the baker.
  if (!ff_dither(base.a, vec2(gl_FragCoord.x, ff_top - gl_FragCoord.y))) discard;
#endif
  vec3 n = normalize(v_normal);
#ifdef BOTH_SIDES
  if (!gl_FrontFacing) n = -n;
#endif
#ifdef UNLIT
  const float unlit = 1.0;
#else
  const float unlit = 0.0;
#endif
  color = vec4(ff_to_srgb(ff_shade(base.rgb, n, emissive, unlit)), 1.0);
}
`;

/** One material per draw state, kept for the life of the walk: a program is compiled only once. */
export class NearMaterials {
  /** Top edge of the viewport in gl_FragCoord's terms. */
  readonly top: IUniform<number> = { value: 0 };
  /** Of the cell that is drawn next. */
  readonly fade: IUniform<number> = { value: 0 };
  readonly light: Light;
  private readonly shared: Uniforms;
  private readonly defines: Readonly<Record<string, string>>;
  private readonly fragment: string;
  private readonly materials = new Map<string, RawShaderMaterial>();

  /**
   * @param nearField half width of the near field, or Infinity to draw all that there is
   * @param fades whether cells ever fade: asking that costs time in every pixel
   */
  constructor(light: Light, nearField: number, fades: boolean) {
    this.light = light;
    this.shared = { ff_top: this.top, ff_fade: this.fade };
    this.fragment = fragment(light);
    this.defines = {
      ...(nearField < Infinity && { NEAR_FIELD: glslFloat(NEAR_OVERLAP * nearField) }),
      ...(fades && { FADE: '' }),
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
    const defines: Record<string, string> = { ...this.defines };
    if (state.map !== undefined) defines.MAP = '';
    if (state.emissiveMap !== undefined) defines.EMISSIVE_MAP = '';
    if (state.emissive.some((value) => value !== 0)) defines.EMISSIVE = '';
    if (state.unlit) defines.UNLIT = '';
    if (state.doubleSided) defines.BOTH_SIDES = '';
    if (state.alpha === 'mask') defines.MASK = '';
    if (state.alpha === 'dither') defines.DITHER = '';
    return new RawShaderMaterial({
      name: 'farfield near',
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: this.fragment,
      defines,
      uniforms: {
        ...this.shared,
        ff_emissive: { value: new Vector3(...state.emissive) },
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
