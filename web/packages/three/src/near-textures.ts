/** Textures of near geometry: shared, under a hard cap, halved in size where they do not fit. */

import {
  FarfieldError,
  SharedStore,
  textureKey,
  type FetchQueue,
  type Loading,
  type NearTexture,
  type UploadScheduler,
  type User,
  type Wrap,
} from '@farfield/core';
import {
  ClampToEdgeWrapping,
  DataTexture,
  LinearFilter,
  LinearMipmapLinearFilter,
  MirroredRepeatWrapping,
  NearestFilter,
  NearestMipmapLinearFilter,
  RepeatWrapping,
  SRGBColorSpace,
  type Texture,
  type WebGLRenderer,
  type Wrapping,
} from 'three';
import { decodeImage, uploadBitmap } from './strip-upload.js';

export interface NearTexturesOptions {
  readonly renderer: WebGLRenderer;
  readonly queue: FetchQueue;
  readonly uploads: UploadScheduler;
  readonly capacity: number;
  readonly pressure: (priority: number) => boolean;
}

const WRAPPINGS: Readonly<Record<Wrap, Wrapping>> = {
  repeat: RepeatWrapping,
  clamp: ClampToEdgeWrapping,
  mirror: MirroredRepeatWrapping,
};

export class NearTextures {
  private readonly options: NearTexturesOptions;
  private readonly store: SharedStore<Texture>;
  private readonly descriptions = new Map<string, NearTexture>();

  constructor(options: NearTexturesOptions) {
    this.options = options;
    this.store = new SharedStore({
      capacity: options.capacity,
      load: (key, loading) => this.load(key, loading),
      dispose: (_, texture) => texture?.dispose(),
      pressure: options.pressure,
    });
  }

  get bytes(): number {
    return this.store.bytes;
  }

  /** The texture, its `uri` made absolute, once all its texels are there. */
  acquire(texture: NearTexture, user: User): Promise<Texture> {
    const key = textureKey(texture);
    this.descriptions.set(key, texture);
    return this.store.acquire(key, user);
  }

  release(texture: NearTexture, user: User): void {
    this.store.release(textureKey(texture), user);
  }

  clear(): void {
    this.store.clear();
  }

  private async load(key: string, { priority, signal, reserve }: Loading): Promise<Texture> {
    const { queue, renderer, uploads } = this.options;
    const description = this.descriptions.get(key);
    if (description === undefined) throw new Error(`Nobody asked for texture ${key}.`);
    let bitmap = await decodeImage(await queue.get(description.uri, priority, signal));
    const limit = renderer.capabilities.maxTextureSize;
    while (Math.max(bitmap.width, bitmap.height) > limit) bitmap = await halve(bitmap);
    for (;;) {
      try {
        reserve(textureBytes(bitmap));
        break;
      } catch (error) {
        const small = Math.max(bitmap.width, bitmap.height) <= 64;
        if (!(error instanceof FarfieldError && error.code === 'too-large') || small) throw error;
        bitmap = await halve(bitmap);
      }
    }
    const texture = describe(description, bitmap.width, bitmap.height);
    renderer.initTexture(texture);
    const mipmap = (): void => {
      texture.generateMipmaps = true;
    };
    try {
      await uploads.add(uploadBitmap(renderer, bitmap, texture, 0, mipmap), priority, signal);
    } catch (error) {
      texture.dispose();
      throw error;
    }
    return texture;
  }
}

/** Bytes of a texture with its mipmaps. */
function textureBytes({ width, height }: { width: number; height: number }): number {
  return Math.ceil((4 * width * height * 4) / 3);
}

async function halve(bitmap: ImageBitmap): Promise<ImageBitmap> {
  const smaller = await createImageBitmap(bitmap, {
    resizeWidth: Math.max(1, bitmap.width >> 1),
    resizeHeight: Math.max(1, bitmap.height >> 1),
    resizeQuality: 'high',
    premultiplyAlpha: 'none',
    colorSpaceConversion: 'none',
  });
  bitmap.close();
  return smaller;
}

/** An empty sRGB texture with room for all mipmaps, which the last strip fills. */
function describe(description: NearTexture, width: number, height: number): DataTexture {
  const texture = new DataTexture(null, width, height);
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = WRAPPINGS[description.wrapS];
  texture.wrapT = WRAPPINGS[description.wrapT];
  const nearest = description.filter === 'nearest';
  texture.magFilter = nearest ? NearestFilter : LinearFilter;
  texture.minFilter = nearest ? NearestMipmapLinearFilter : LinearMipmapLinearFilter;
  texture.generateMipmaps = false;
  // Naming the levels makes three.js allocate them all without computing them from nothing.
  const levels = Math.floor(Math.log2(Math.max(width, height))) + 1;
  texture.mipmaps = Array.from({ length: levels }, (_, level) => ({
    data: new Uint8Array(0),
    width: Math.max(1, width >> level),
    height: Math.max(1, height >> level),
  }));
  texture.source.dataReady = false;
  texture.needsUpdate = true;
  return texture;
}
