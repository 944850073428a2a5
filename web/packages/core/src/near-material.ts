/** How a near primitive is drawn: its glTF material, reduced to what the light model knows. */

import type { Glb, GltfTextureInfo } from './glb.js';

export type Wrap = 'repeat' | 'clamp' | 'mirror';

/** A texture of near geometry; equal fields mean the same texture. */
export interface NearTexture {
  /** Address relative to the near block. */
  readonly uri: string;
  readonly wrapS: Wrap;
  readonly wrapT: Wrap;
  readonly filter: 'linear' | 'nearest';
}

export interface NearState {
  readonly map: NearTexture | undefined;
  readonly emissiveMap: NearTexture | undefined;
  /** Linear. */
  readonly emissive: readonly [number, number, number];
  readonly alpha: 'opaque' | 'mask' | 'dither';
  readonly cutoff: number;
  readonly doubleSided: boolean;
  readonly unlit: boolean;
}

/** Equal for states that can be drawn together. */
export function stateKey(state: NearState): string {
  return JSON.stringify(state);
}

/** The key under which a texture is shared. */
export function textureKey(texture: NearTexture): string {
  return `${texture.uri}|${texture.wrapS}|${texture.wrapT}|${texture.filter}`;
}

export interface NearMaterial {
  readonly state: NearState;
  /** Linear RGBA that multiplies vertex colours. */
  readonly factor: readonly [number, number, number, number];
  /** Row-major 2x3 map of texture coordinates. */
  readonly uvTransform: readonly [number, number, number, number, number, number];
}

/** Read material `index` of a near block; undefined is glTF's default material. */
export function readMaterial(glb: Glb, index: number | undefined): NearMaterial {
  const material = (index === undefined ? undefined : glb.json.materials?.at(index)) ?? {};
  const pbr = material.pbrMetallicRoughness ?? {};
  const strength = material.extensions?.KHR_materials_emissive_strength?.emissiveStrength ?? 1;
  const [er, eg, eb] = material.emissiveFactor ?? [0, 0, 0];
  const [r, g, b, a] = pbr.baseColorFactor ?? [1, 1, 1, 1];
  const mode = material.alphaMode ?? 'OPAQUE';
  const dither = material.extras?.alpha === 'dither' || mode === 'BLEND';
  return {
    state: {
      map: readTexture(glb, pbr.baseColorTexture),
      emissiveMap: readTexture(glb, material.emissiveTexture),
      emissive: [er * strength, eg * strength, eb * strength],
      alpha: dither ? 'dither' : mode === 'MASK' ? 'mask' : 'opaque',
      cutoff: material.alphaCutoff ?? 0.5,
      doubleSided: material.doubleSided ?? false,
      unlit: material.extensions?.KHR_materials_unlit !== undefined,
    },
    factor: [r, g, b, a],
    uvTransform: readTransform(pbr.baseColorTexture ?? material.emissiveTexture),
  };
}

function readTexture(glb: Glb, info: GltfTextureInfo | undefined): NearTexture | undefined {
  const texture = info === undefined ? undefined : glb.json.textures?.at(info.index);
  const uri = texture?.source === undefined ? undefined : glb.json.images?.at(texture.source)?.uri;
  if (texture === undefined || uri === undefined) return undefined;
  const sampler =
    (texture.sampler === undefined ? undefined : glb.json.samplers?.at(texture.sampler)) ?? {};
  return {
    uri,
    wrapS: wrap(sampler.wrapS),
    wrapT: wrap(sampler.wrapT),
    filter: sampler.magFilter === 9728 ? 'nearest' : 'linear',
  };
}

function wrap(code: number | undefined): Wrap {
  return code === 33071 ? 'clamp' : code === 33648 ? 'mirror' : 'repeat';
}

/** KHR_texture_transform: translation * rotation * scale. */
function readTransform(info: GltfTextureInfo | undefined): NearMaterial['uvTransform'] {
  const { offset, scale, rotation } = info?.extensions?.KHR_texture_transform ?? {};
  const [ox, oy] = offset ?? [0, 0];
  const [sx, sy] = scale ?? [1, 1];
  const [cos, sin] = [Math.cos(rotation ?? 0), Math.sin(rotation ?? 0)];
  return [cos * sx, sin * sy, ox, -sin * sx, cos * sy, oy];
}
