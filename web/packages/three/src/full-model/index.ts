/** The whole model that a walk stands for, as polygons: for comparing, where it is small enough. */

import { FarfieldError, FetchQueue, type Light, type NearState, type Vec3 } from '@farfield/core';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  LinearFilter,
  LinearMipmapLinearFilter,
  ClampToEdgeWrapping,
  Mesh,
  MirroredRepeatWrapping,
  NearestFilter,
  NearestMipmapLinearFilter,
  RepeatWrapping,
  SRGBColorSpace,
  Sphere,
  Texture,
  Vector3,
  Vector4,
} from 'three';
import { NearMaterials } from '../near-materials.js';
import { decodeImage } from '../strip-upload.js';
import { cutChunks } from './chunks.js';
import { readNpy, type NpyData } from './npy.js';

export { cutChunks, type Chunk, type SceneArrays } from './chunks.js';
export { readNpy, type Npy } from './npy.js';

/** scene.json of a prepared scene, as far as drawing needs it. */
interface SceneFile {
  readonly origin: Vec3;
  readonly triangles: number;
  readonly textures: readonly {
    readonly file: string;
    readonly wrap_u: keyof typeof WRAPPINGS;
    readonly wrap_v: keyof typeof WRAPPINGS;
    readonly filter: 'linear' | 'nearest';
  }[];
  readonly batches: readonly {
    readonly texture: number | null;
    readonly emissive: Vec3;
    readonly emissive_texture: number | null;
    readonly alpha: NearState['alpha'];
    readonly cutoff: number;
    readonly double_sided: boolean;
    readonly unlit: boolean;
  }[];
  readonly blocks: readonly {
    readonly parts: readonly {
      readonly batch: number;
      readonly first_triangle: number;
      readonly triangles: number;
    }[];
  }[];
}

const WRAPPINGS = {
  repeat: RepeatWrapping,
  clamp: ClampToEdgeWrapping,
  mirror: MirroredRepeatWrapping,
} as const;

export interface FullModelOptions {
  /** Constants of the light model: the walk's own. */
  readonly light: Light;
  /** About how many chunks the ground is divided into. Default 64. */
  readonly chunks?: number;
  /** Refuse models of more triangles than this. Default 2,000,000. */
  readonly most?: number;
  readonly queue?: FetchQueue;
}

/** Adds up to one mesh per chunk and draw state to `group`, each culled by the camera's frustum. */
export class FullModel {
  /** Add this to your scene, beside the walk's group. */
  readonly group = new Group();
  /** Settles when everything is there; rejects with FarfieldError, 'too-large' beyond the limit. */
  readonly loaded: Promise<void>;
  triangles = 0;
  private readonly materials: NearMaterials;
  private readonly textures: Texture[] = [];
  private readonly meshes: Mesh[] = [];
  private readonly abort = new AbortController();

  /** @param url the folder of the prepared scene, ending in a slash */
  constructor(url: string, options: FullModelOptions) {
    this.group.name = 'farfield full model';
    this.materials = new NearMaterials(options.light, Infinity, false);
    this.loaded = this.load(url, options);
    this.loaded.catch(() => undefined);
  }

  dispose(): void {
    this.abort.abort();
    this.group.removeFromParent();
    for (const { geometry } of this.meshes) geometry.dispose();
    this.group.clear();
    this.materials.dispose();
    for (const texture of this.textures) texture.dispose();
  }

  private async load(url: string, options: FullModelOptions): Promise<void> {
    const queue = options.queue ?? new FetchQueue();
    const { signal } = this.abort;
    const get = (name: string): Promise<ArrayBuffer> =>
      queue.get(new URL(name, url).href, undefined, signal);
    const scene = JSON.parse(new TextDecoder().decode(await get('scene.json'))) as SceneFile;
    if (scene.triangles > (options.most ?? 2e6)) {
      throw new FarfieldError(
        'too-large',
        `The full model has ${(scene.triangles / 1e6).toFixed(1)} million triangles, too many for a browser.`,
      );
    }
    const array = async (name: string): Promise<NpyData> => readNpy(await get(name)).data;
    const [positions, normals, uvs, colors, triangles] = await Promise.all(
      ['positions', 'normals', 'uvs', 'colors', 'triangles'].map((name) => array(`${name}.npy`)),
    );
    const textures = await Promise.all(
      scene.textures.map(async (entry) => {
        const texture = describe(entry, await decodeImage(await get(`textures/${entry.file}`)));
        this.textures.push(texture);
        return texture;
      }),
    );
    signal.throwIfAborted();
    this.group.position.set(...scene.origin);
    const batches = scene.batches.map((_, batch) =>
      scene.blocks.flatMap(({ parts }) =>
        parts
          .filter((part) => part.batch === batch)
          .map((part) => [part.first_triangle, part.triangles] as const),
      ),
    );
    const chunks = cutChunks(
      {
        positions: positions as Float32Array,
        triangles: triangles as Uint32Array,
        batches,
      },
      options.chunks ?? 64,
    );
    const materials = scene.batches.map((batch, n) =>
      this.materials.get(
        state(batch, n),
        batch.texture === null ? undefined : textures[batch.texture],
        batch.emissive_texture === null ? undefined : textures[batch.emissive_texture],
      ),
    );
    for (const { batch, vertices, indices } of chunks) {
      const geometry = new BufferGeometry();
      const pick = (data: NpyData, width: number): NpyData => gather(data, width, vertices);
      geometry.setAttribute('position', new BufferAttribute(pick(positions, 3), 3));
      geometry.setAttribute('normal', new BufferAttribute(pick(normals, 4), 4, true));
      geometry.setAttribute('color', new BufferAttribute(pick(colors, 4), 4, true));
      const { texture, emissive_texture } = scene.batches[batch];
      if (texture !== null || emissive_texture !== null) {
        geometry.setAttribute('uv', new BufferAttribute(pick(uvs, 2), 2));
      }
      geometry.setIndex(new BufferAttribute(indices, 1));
      this.add(geometry, materials[batch]);
    }
    this.triangles = scene.triangles;
  }

  /** A mesh that stands at its own centre, so that three.js culls and sorts it. */
  private add(geometry: BufferGeometry, material: Mesh['material']): void {
    geometry.computeBoundingBox();
    const centre = geometry.boundingBox?.getCenter(new Vector3()) ?? new Vector3();
    const { array } = geometry.attributes.position;
    let radius = 0;
    for (let n = 0; n < array.length; n += 3) {
      array[n] -= centre.x;
      array[n + 1] -= centre.y;
      array[n + 2] -= centre.z;
      radius = Math.max(radius, Math.hypot(array[n], array[n + 1], array[n + 2]));
    }
    geometry.boundingBox = null;
    geometry.boundingSphere = new Sphere(new Vector3(), radius);
    const mesh = new Mesh(geometry, material);
    mesh.position.copy(centre);
    mesh.raycast = () => undefined;
    const { top } = this.materials;
    const viewport = new Vector4();
    mesh.onBeforeRender = (renderer) => {
      renderer.getCurrentViewport(viewport);
      top.value = viewport.y + viewport.w;
    };
    this.meshes.push(mesh);
    this.group.add(mesh);
  }
}

/** Every batch is a state of its own, whatever its looks, so that each has its textures. */
function state(batch: SceneFile['batches'][number], number: number): NearState {
  const texture = (index: number | null): NearState['map'] =>
    index === null
      ? undefined
      : { uri: `${number}/${index}`, wrapS: 'repeat', wrapT: 'repeat', filter: 'linear' };
  return {
    map: texture(batch.texture),
    emissiveMap: texture(batch.emissive_texture),
    emissive: batch.emissive,
    alpha: batch.alpha,
    cutoff: batch.cutoff,
    doubleSided: batch.double_sided,
    unlit: batch.unlit,
  };
}

function gather(data: NpyData, width: number, vertices: Uint32Array): NpyData {
  const picked = data.slice(0, width * vertices.length);
  for (let n = 0; n < vertices.length; n++) {
    for (let c = 0; c < width; c++) picked[width * n + c] = data[width * vertices[n] + c];
  }
  return picked;
}

function describe(entry: SceneFile['textures'][number], bitmap: ImageBitmap): Texture {
  const texture = new Texture(bitmap);
  texture.flipY = false;
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = WRAPPINGS[entry.wrap_u];
  texture.wrapT = WRAPPINGS[entry.wrap_v];
  const nearest = entry.filter === 'nearest';
  texture.magFilter = nearest ? NearestFilter : LinearFilter;
  texture.minFilter = nearest ? NearestMipmapLinearFilter : LinearMipmapLinearFilter;
  texture.needsUpdate = true;
  return texture;
}
