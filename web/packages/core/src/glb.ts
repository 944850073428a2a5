/**
 * A reader for the glTF binaries that near blocks are: meshes, accessors, materials and the names
 * of sibling images. Small on purpose: it runs in a worker, makes no engine objects, and loads no
 * textures, which many blocks share.
 */

import { FarfieldError } from './errors.js';
import { unpackTriangles } from './packed-triangles.js';

export interface GltfTextureInfo {
  readonly index: number;
  readonly texCoord?: number;
  readonly extensions?: {
    readonly KHR_texture_transform?: {
      readonly offset?: readonly [number, number];
      readonly scale?: readonly [number, number];
      readonly rotation?: number;
    };
  };
}

export interface GltfMaterial {
  readonly pbrMetallicRoughness?: {
    readonly baseColorFactor?: readonly number[];
    readonly baseColorTexture?: GltfTextureInfo;
  };
  readonly emissiveFactor?: readonly number[];
  readonly emissiveTexture?: GltfTextureInfo;
  readonly alphaMode?: 'OPAQUE' | 'MASK' | 'BLEND';
  readonly alphaCutoff?: number;
  readonly doubleSided?: boolean;
  readonly extensions?: {
    readonly KHR_materials_unlit?: object;
    readonly KHR_materials_emissive_strength?: { readonly emissiveStrength?: number };
  };
  readonly extras?: { readonly alpha?: string };
}

export interface GltfPrimitive {
  readonly attributes: Readonly<Record<string, number | undefined>>;
  readonly indices?: number;
  readonly material?: number;
  readonly mode?: number;
  /** `owners`: an accessor with a number for each triangle, see docs/format.md. */
  readonly extras?: { readonly owners?: number };
}

/** What a buffer view is unpacked from. */
export interface PackedView {
  readonly buffer: number;
  readonly byteOffset?: number;
  readonly byteLength: number;
  readonly byteStride: number;
  readonly count: number;
  readonly mode: string;
}

export interface Gltf {
  readonly accessors?: readonly {
    readonly bufferView?: number;
    readonly byteOffset?: number;
    readonly componentType: number;
    readonly normalized?: boolean;
    readonly count: number;
    readonly type: string;
    readonly sparse?: object;
  }[];
  readonly bufferViews?: readonly {
    readonly byteOffset?: number;
    readonly byteLength: number;
    readonly byteStride?: number;
    readonly extensions?: { readonly EXT_meshopt_compression?: PackedView };
  }[];
  readonly extras?: {
    readonly objects?: {
      readonly shapes?: readonly string[];
      readonly shape?: readonly number[];
      readonly places?: readonly number[];
      readonly turns?: readonly number[];
    };
  };
  readonly extensionsRequired?: readonly string[];
  readonly images?: readonly { readonly uri?: string }[];
  readonly materials?: readonly GltfMaterial[];
  readonly meshes?: readonly { readonly primitives: readonly GltfPrimitive[] }[];
  readonly nodes?: readonly {
    readonly mesh?: number;
    readonly translation?: readonly number[];
    readonly scale?: readonly number[];
    readonly rotation?: readonly number[];
    readonly matrix?: readonly number[];
  }[];
  readonly samplers?: readonly {
    readonly magFilter?: number;
    readonly wrapS?: number;
    readonly wrapT?: number;
  }[];
  readonly textures?: readonly { readonly source?: number; readonly sampler?: number }[];
}

export interface Glb {
  readonly json: Gltf;
  readonly bin: Uint8Array;
  /** Packed buffer views that were read. */
  readonly unpacked: Map<number, Uint32Array>;
}

type Components = Int8Array | Uint8Array | Int16Array | Uint16Array | Uint32Array | Float32Array;

/** Values of an accessor: component c of element n is data[n * stride + c] * scale. */
export interface AccessorView {
  readonly data: Components;
  /** Components from one element to the next. */
  readonly stride: number;
  readonly components: number;
  readonly count: number;
  /** 1 / the type's greatest value where the accessor is normalised, else 1. */
  readonly scale: number;
}

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BIN_CHUNK = 0x004e4942;
const READABLE = new Set([
  'KHR_mesh_quantization',
  'KHR_materials_unlit',
  'KHR_texture_transform',
  'KHR_materials_emissive_strength',
  'EXT_meshopt_compression',
]);
const WIDTHS: Readonly<Record<string, number | undefined>> = {
  SCALAR: 1,
  VEC2: 2,
  VEC3: 3,
  VEC4: 4,
};

/** Divide a GLB into its JSON and binary parts; throws FarfieldError 'format'. */
export function parseGlb(bytes: ArrayBuffer): Glb {
  const view = new DataView(bytes);
  if (bytes.byteLength < 20 || view.getUint32(0, true) !== MAGIC || view.getUint32(4, true) !== 2) {
    throw new FarfieldError('format', 'A near block is not a glTF 2.0 binary.');
  }
  const length = view.getUint32(8, true);
  if (length > bytes.byteLength) throw new FarfieldError('format', 'A near block is cut short.');
  let json: Gltf | undefined;
  let bin = new Uint8Array(0);
  for (let at = 12; at + 8 <= length;) {
    const size = view.getUint32(at, true);
    const kind = view.getUint32(at + 4, true);
    if (at + 8 + size > length) throw new FarfieldError('format', 'A near block is cut short.');
    const chunk = new Uint8Array(bytes, at + 8, size);
    if (kind === JSON_CHUNK) json = JSON.parse(new TextDecoder().decode(chunk)) as Gltf;
    else if (kind === BIN_CHUNK) bin = chunk;
    at += 8 + size + ((4 - (size % 4)) % 4);
  }
  if (json === undefined) throw new FarfieldError('format', 'A near block has no JSON part.');
  for (const name of json.extensionsRequired ?? []) {
    if (!READABLE.has(name)) {
      throw new FarfieldError('format', `A near block needs the glTF extension ${name}.`);
    }
  }
  return { json, bin, unpacked: new Map() };
}

/** The values of accessor `index`, in place where alignment allows. */
export function readAccessor(glb: Glb, index: number): AccessorView {
  const accessor = glb.json.accessors?.at(index);
  const components = accessor === undefined ? undefined : WIDTHS[accessor.type];
  if (accessor?.bufferView === undefined || components === undefined || accessor.sparse) {
    throw new FarfieldError('format', `A near block has no readable accessor ${index}.`);
  }
  const view = glb.json.bufferViews?.at(accessor.bufferView);
  if (view === undefined) {
    throw new FarfieldError('format', `A near block has no buffer view ${accessor.bufferView}.`);
  }
  const { bytes, make, scale } = componentType(accessor.componentType);
  const packed = view.extensions?.EXT_meshopt_compression;
  if (packed !== undefined) {
    const all = unpack(glb, accessor.bufferView, packed);
    const first = (accessor.byteOffset ?? 0) / packed.byteStride;
    const fits = components === 1 && packed.byteStride === bytes && Number.isInteger(first);
    if (!fits || first + accessor.count > all.length) {
      throw new FarfieldError('format', `Accessor ${index} of a near block reaches past its data.`);
    }
    const data = all.subarray(first, first + accessor.count);
    return { data, stride: 1, components, count: accessor.count, scale: 1 };
  }
  const strideBytes = view.byteStride ?? bytes * components;
  const start = (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  const length = accessor.count === 0 ? 0 : (accessor.count - 1) * strideBytes + bytes * components;
  if (strideBytes % bytes !== 0 || start + length > glb.bin.byteLength) {
    throw new FarfieldError('format', `Accessor ${index} of a near block reaches past its data.`);
  }
  const offset = glb.bin.byteOffset + start;
  const data =
    offset % bytes === 0
      ? make(glb.bin.buffer as ArrayBuffer, offset, length / bytes)
      : make(glb.bin.slice(start, start + length).buffer, 0, length / bytes);
  return {
    data,
    stride: strideBytes / bytes,
    components,
    count: accessor.count,
    scale: accessor.normalized === true ? scale : 1,
  };
}

function unpack(glb: Glb, number: number, view: PackedView): Uint32Array {
  const known = glb.unpacked.get(number);
  if (known !== undefined) return known;
  if (view.mode !== 'TRIANGLES' || view.buffer !== 0) {
    throw new FarfieldError('format', 'A near block is packed in a way this viewer cannot read.');
  }
  const start = view.byteOffset ?? 0;
  const packed = glb.bin.subarray(start, start + view.byteLength);
  if (packed.length < view.byteLength) {
    throw new FarfieldError('format', 'A near block is cut short.');
  }
  const all = unpackTriangles(packed, view.count);
  glb.unpacked.set(number, all);
  return all;
}

function componentType(code: number): {
  bytes: number;
  scale: number;
  make: (buffer: ArrayBuffer, offset: number, length: number) => Components;
} {
  switch (code) {
    case 5120:
      return { bytes: 1, scale: 1 / 127, make: (b, o, n) => new Int8Array(b, o, n) };
    case 5121:
      return { bytes: 1, scale: 1 / 255, make: (b, o, n) => new Uint8Array(b, o, n) };
    case 5122:
      return { bytes: 2, scale: 1 / 32767, make: (b, o, n) => new Int16Array(b, o, n) };
    case 5123:
      return { bytes: 2, scale: 1 / 65535, make: (b, o, n) => new Uint16Array(b, o, n) };
    case 5125:
      return { bytes: 4, scale: 1, make: (b, o, n) => new Uint32Array(b, o, n) };
    case 5126:
      return { bytes: 4, scale: 1, make: (b, o, n) => new Float32Array(b, o, n) };
    default:
      throw new FarfieldError('format', `A near block uses the unknown component type ${code}.`);
  }
}
