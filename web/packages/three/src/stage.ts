/** Everything of a walk that lives on the graphics card; built anew when a context was lost. */

import {
  CellStreamer,
  UploadScheduler,
  type Cell,
  type CellBuilder,
  type CellIndex,
  type FetchQueue,
  type Manifest,
} from '@farfield/core';
import { Vector4, type Camera, type Group, type IUniform, type WebGLRenderer } from 'three';
import { AttributeUpload } from './attribute-upload.js';
import { CellLoader } from './cell-loader.js';
import type { CellView } from './cell-view.js';
import { fadeWith } from './fade.js';
import { createFarMaterial } from './far-material.js';
import { NearMaterials } from './near-materials.js';
import { NearTextures } from './near-textures.js';
import { Shapes } from './objects/shapes.js';
import { PagePool } from './page-pool.js';
import { createSky, type Sky } from './sky.js';

export interface StageOptions {
  readonly renderer: WebGLRenderer;
  readonly manifest: Manifest;
  readonly index: CellIndex;
  readonly queue: FetchQueue;
  readonly builder: CellBuilder;
  readonly group: Group;
  readonly camera: () => Camera | undefined;
  readonly textureBytes: number;
  readonly geometryBytes: number;
  readonly prefetch: number;
  readonly sky: boolean;
  /** Draw objects that repeat as true impostors where that is wanted. */
  readonly repeats: boolean;
  readonly backgroundAlpha: IUniform<number>;
  /** Whether cells ever fade. */
  readonly fades: boolean;
  readonly onReady: (cell: Cell, seconds: number) => void;
  readonly onError: (cell: Cell, error: Error) => void;
}

/** Share of the texture memory that atlas pages get; textures of near geometry get the rest. */
const PAGE_SHARE = 0.6;
/** The share of objects that repeat, where they are drawn. */
const SHAPE_SHARE = 0.1;

export class Stage {
  readonly uploads = new UploadScheduler();
  readonly attributes: AttributeUpload;
  readonly pages: PagePool;
  readonly textures: NearTextures;
  readonly shapes: Shapes | undefined;
  readonly streamer: CellStreamer<CellView>;
  readonly sky: Sky | undefined;
  private readonly materials: NearMaterials;
  private readonly farMaterial;
  private readonly loader: CellLoader;

  constructor(options: StageOptions) {
    const { renderer, manifest, index, queue, builder, group } = options;
    const { light, near_field } = manifest.walk;
    const { uploads } = this;
    const pressure = (priority: number): boolean => this.streamer.evict(priority);
    this.attributes = new AttributeUpload(uploads);
    this.pages = new PagePool({
      renderer,
      manifest,
      queue,
      uploads,
      capacity: PAGE_SHARE * options.textureBytes,
      pressure,
    });
    this.textures = new NearTextures({
      renderer,
      queue,
      uploads,
      capacity: Math.max(
        0,
        (options.repeats ? 1 - SHAPE_SHARE : 1) * options.textureBytes - this.pages.bytes,
      ),
      pressure,
    });
    this.materials = new NearMaterials(light, near_field, options.fades);
    this.farMaterial = createFarMaterial(this.pages.texture, this.materials.fade, options.fades);
    this.shapes = options.repeats
      ? new Shapes(manifest, queue, SHAPE_SHARE * options.textureBytes)
      : undefined;
    this.loader = new CellLoader({
      manifest,
      queue,
      builder,
      pages: this.pages,
      textures: this.textures,
      materials: this.materials,
      farMaterial: this.farMaterial,
      attributes: this.attributes,
      shapes: this.shapes,
      compile: async (view) => {
        const camera = options.camera();
        if (camera !== undefined) await renderer.compileAsync(view.group, camera);
        this.prepare(view);
      },
    });
    this.streamer = new CellStreamer({
      index,
      load: async (job) => {
        const loaded = await this.loader.load(job);
        group.add(loaded.view.group);
        return loaded;
      },
      dispose: (view) => view.dispose(),
      capacity: options.geometryBytes,
      prefetch: options.prefetch,
      onReady: options.onReady,
      onError: options.onError,
    });
    this.sky = options.sky ? createSky(light, options.backgroundAlpha) : undefined;
    group.add(this.attributes.group, ...(this.sky === undefined ? [] : [this.sky]));
  }

  dispose(): void {
    this.streamer.dispose();
    this.loader.dispose();
    this.pages.dispose();
    this.textures.clear();
    this.shapes?.clear();
    this.materials.dispose();
    this.farMaterial.dispose();
    this.attributes.group.removeFromParent();
    this.attributes.dispose();
    this.sky?.removeFromParent();
    this.sky?.geometry.dispose();
    this.sky?.material.dispose();
  }

  /**
   * Tell meshes of their cell's fade; far ones what the camera sees, near ones where the top of the
   * picture is, for the dither pattern.
   */
  private prepare(view: CellView): void {
    const { fade, top } = this.materials;
    const viewport = new Vector4();
    for (const mesh of view.copies?.meshes ?? []) {
      const prepare = mesh.onBeforeRender.bind(mesh);
      mesh.onBeforeRender = (...all) => {
        fade.value = view.fade;
        prepare(...all);
      };
    }
    for (const mesh of view.farMeshes) {
      mesh.onBeforeRender = (_renderer, _scene, camera) => {
        fadeWith(view, mesh, fade);
        if (mesh === view.far) view.aim(camera);
      };
    }
    for (const mesh of view.near) {
      mesh.onBeforeRender = (renderer) => {
        fadeWith(view, mesh, fade);
        renderer.getCurrentViewport(viewport);
        if (top.value === viewport.y + viewport.w) return;
        top.value = viewport.y + viewport.w;
        mesh.material.uniformsNeedUpdate = true;
      };
    }
  }
}
