/** A walk in a three.js scene. */

import {
  CellIndex,
  FarfieldError,
  FetchQueue,
  absoluteUrl,
  asError,
  createBuilder,
  parseManifest,
  type Cell,
  type CellBuilder,
  type CellTable,
  type Manifest,
  type Solid,
  type Vec3,
} from '@farfield/core';
import {
  EventDispatcher,
  Group,
  Vector3,
  type Camera,
  type IUniform,
  type Object3D,
  type WebGLRenderer,
} from 'three';
import type { CellView } from './cell-view.js';
import { Fade } from './fade.js';
import { MotionTracker } from './motion.js';
import type { ImpostorOptions } from './objects/object-impostor.js';
import { WalkObjects, type NearImpostors } from './objects/walk-objects.js';
import { Stage } from './stage.js';
import { readStats, type WalkStats } from './stats.js';

export interface WalkOptions {
  /** The renderer that draws the walk; needed to upload before drawing. */
  readonly renderer: WebGLRenderer;
  /** Texture memory, a hard cap. Default 256 MiB. */
  readonly textureBytes?: number;
  /** Vertex and index buffers of all loaded cells, a hard cap. Default 192 MiB. */
  readonly geometryBytes?: number;
  /** Bytes uploaded in one frame. Default 1 MiB. */
  readonly uploadBytes?: number;
  /** Cells wanted at once, the walker's own included. Default 12. */
  readonly prefetch?: number;
  /** Draw the walk's sky as background. Default true. */
  readonly sky?: boolean;
  /** What the sky writes as alpha; 0 marks background pixels on a canvas with alpha. Default 1. */
  readonly backgroundAlpha?: number;
  /** Downloads; share one between walks to share its limit of requests. */
  readonly queue?: FetchQueue;
  /** Seconds in which one cell fades into the next. Default 0: at once. */
  readonly fade?: number;
  /**
   * Whether costly objects of the near field are drawn as impostors. Default 'never'; then it may be
   * changed later, but objects that repeat stay polygons.
   */
  readonly nearImpostors?: NearImpostors;
}

export interface WalkEvents {
  /** The manifest is there; cells start to load. */
  load: { manifest: Manifest };
  /** The walk cannot be opened. */
  error: { error: Error };
  /** Another cell is shown; undefined never follows a cell. */
  'cell-change': { cell: Cell };
  /** A cell is complete. */
  'cell-ready': { cell: Cell; seconds: number };
  /** A cell could not be loaded; it is tried again. `absent`: it is not baked yet. */
  'cell-error': { cell: Cell; error: Error; absent: boolean };
  'context-lost': object;
  'context-restored': object;
}

const MEGABYTE = 2 ** 20;
/** Cells ahead of a walker that prefetching counts on. */
const LEAD = 1.5;

export class Walk extends EventDispatcher<WalkEvents> {
  /** Add this to your scene. It may be moved and turned. */
  readonly group = new Group();
  /** Settles when the manifest is there, or rejects with the reason why not. */
  readonly loaded: Promise<Manifest>;
  readonly url: string;
  manifest: Manifest | undefined;
  index: CellIndex | undefined;
  /** Keep the shown cell while the camera moves on. */
  frozen = false;
  /** Draw cells; the sky is drawn without them too. */
  visible = true;
  /** Object impostors: what was placed with `add`, and objects of the near field. */
  readonly objects: WalkObjects;
  private readonly options: WalkOptions;
  private readonly queue: FetchQueue;
  private readonly builder: CellBuilder;
  private readonly motion = new MotionTracker();
  private readonly fade: Fade;
  private readonly abort = new AbortController();
  private readonly alpha: IUniform<number>;
  private stage: Stage | undefined;
  private camera: Camera | undefined;
  private shownView: CellView | undefined;
  private shown: Cell | undefined;
  private ensuredAt: Vec3 | undefined;
  private loadSeconds = 0;

  constructor(url: string, options: WalkOptions) {
    super();
    this.group.name = 'farfield walk';
    this.url = absoluteUrl(url);
    this.options = options;
    this.queue = options.queue ?? new FetchQueue();
    this.builder = createBuilder();
    this.objects = new WalkObjects({
      renderer: options.renderer,
      builder: this.builder,
      group: this.group,
      near: options.nearImpostors ?? 'never',
    });
    this.fade = new Fade(options.fade ?? 0);
    this.alpha = { value: options.backgroundAlpha ?? 1 };
    this.loaded = this.load();
    this.loaded.catch((error: unknown) => {
      if (!this.abort.signal.aborted) this.dispatchEvent({ type: 'error', error: asError(error) });
    });
    const { domElement } = options.renderer;
    domElement.addEventListener('webglcontextlost', this.onContextLost);
    domElement.addEventListener('webglcontextrestored', this.onContextRestored);
    if (typeof window !== 'undefined') window.addEventListener('online', this.onOnline);
  }

  /** The camera whose place decides which cells are loaded. */
  setCamera(camera: Camera): void {
    this.camera = camera;
  }

  /** Call once a frame, before drawing; `now` is the time for fades, in seconds. */
  update(now = performance.now() / 1000): void {
    const { stage, camera, index } = this;
    if (stage === undefined || camera === undefined || index === undefined) return;
    camera.updateWorldMatrix(true, false);
    this.group.updateWorldMatrix(true, false);
    const motion = this.motion.update(camera, this.group);
    this.ensure(motion.eye);
    if (!this.frozen) {
      const view = stage.streamer.update(motion);
      const { shown } = stage.streamer;
      if (view !== undefined && view !== this.shownView) {
        this.fade.change(this.shownView, view, now);
        this.shownView = view;
        if (shown !== undefined && shown.name !== this.shown?.name) {
          this.shown = shown;
          this.dispatchEvent({ type: 'cell-change', cell: shown });
        }
      }
    }
    this.showCells();
    this.fade.update(now, this.visible);
    stage.uploads.frame(this.options.uploadBytes ?? MEGABYTE);
    stage.attributes.update();
    this.objects.update(this.view, this.manifest?.walk.near_field ?? Infinity, camera, now);
  }

  /**
   * Place an object in the walk, in its coordinates: it is drawn as an impostor while a picture of
   * it is good enough, and moves, turns and is animated like any other.
   */
  add(object: Object3D, options?: ImpostorOptions): void {
    this.objects.add(object, options);
  }

  /** Take an object out of the walk. */
  remove(object: Object3D): void {
    this.objects.remove(object);
  }

  /** Make a change of `visible` count before the next `update`. */
  showCells(): void {
    if (this.shownView !== undefined) this.shownView.group.visible = this.visible;
  }

  /** Whether the camera's own cell is complete and shown. */
  get settled(): boolean {
    return this.stage?.streamer.settled ?? false;
  }

  /** Whether nothing is being loaded. */
  get idle(): boolean {
    return this.stage?.streamer.idle ?? false;
  }

  /** The cell that is shown. */
  get cell(): Cell | undefined {
    return this.shown;
  }

  /** The shown cell's meshes. */
  get view(): CellView | undefined {
    return this.shownView;
  }

  /** What a walker in the shown cell stands on and bumps into. */
  get solid(): Solid | undefined {
    return this.shownView?.solid;
  }

  /** Metres a second at which cells still arrive in time, from how long they took to load lately. */
  get topSpeed(): number {
    const { index, loadSeconds } = this;
    if (index === undefined || loadSeconds === 0) return Infinity;
    return (LEAD * index.cellSize) / loadSeconds;
  }

  /** The cell that should be shown, and what has become of it. */
  get wanted(): { cell: Cell; state: string; error?: Error } | undefined {
    const streamer = this.stage?.streamer;
    const cell = streamer?.wanted;
    if (streamer === undefined || cell === undefined) return undefined;
    const error = streamer.error(cell.name);
    return { cell, state: streamer.state(cell.name) ?? 'loading', ...(error && { error }) };
  }

  /** What becomes of a cell, by name. */
  cellState(name: string): 'ready' | 'loading' | 'absent' | 'failed' | undefined {
    return this.stage?.streamer.state(name);
  }

  /** Numbers for a readout. */
  get stats(): WalkStats {
    return readStats({
      stage: this.stage,
      view: this.shownView,
      cell: this.shown,
      queue: this.queue,
      loadSeconds: this.loadSeconds,
      textureCap: this.textureBytes,
    });
  }

  /** Try again now what could not be loaded. */
  retry(): void {
    this.stage?.streamer.retry();
  }

  dispose(): void {
    this.abort.abort();
    const { domElement } = this.options.renderer;
    domElement.removeEventListener('webglcontextlost', this.onContextLost);
    domElement.removeEventListener('webglcontextrestored', this.onContextRestored);
    if (typeof window !== 'undefined') window.removeEventListener('online', this.onOnline);
    this.objects.dispose();
    this.stage?.dispose();
    this.stage = undefined;
    this.builder.dispose();
    this.group.removeFromParent();
    this.group.clear();
  }

  private get textureBytes(): number {
    return this.options.textureBytes ?? 256 * MEGABYTE;
  }

  private async load(): Promise<Manifest> {
    const { signal } = this.abort;
    const manifest = await this.queue
      .get(this.url, undefined, signal)
      .then((bytes) => parseManifest(bytes, this.url));
    signal.throwIfAborted();
    this.manifest = manifest;
    this.index = new CellIndex(manifest.walk.grid, async (href) => {
      const bytes = await this.queue.get(manifest.resolve(href), undefined, signal);
      return JSON.parse(new TextDecoder().decode(bytes)) as CellTable;
    });
    await this.index.ensureNearest(manifest.walk.start.eye);
    signal.throwIfAborted();
    this.build();
    this.dispatchEvent({ type: 'load', manifest });
    return manifest;
  }

  private build(): void {
    const { manifest, index } = this;
    if (manifest === undefined || index === undefined) return;
    this.stage = new Stage({
      renderer: this.options.renderer,
      manifest,
      index,
      queue: this.queue,
      builder: this.builder,
      group: this.group,
      camera: () => this.camera,
      textureBytes: this.textureBytes,
      geometryBytes: this.options.geometryBytes ?? 192 * MEGABYTE,
      prefetch: this.options.prefetch ?? 12,
      sky: this.options.sky ?? true,
      repeats: ['auto', 'copies'].includes(this.objects.near),
      backgroundAlpha: this.alpha,
      fades: (this.options.fade ?? 0) > 0,
      onReady: (cell, seconds) => {
        this.loadSeconds += (seconds - this.loadSeconds) * (this.loadSeconds === 0 ? 1 : 0.2);
        this.dispatchEvent({ type: 'cell-ready', cell, seconds });
      },
      onError: (cell, error) => {
        const absent = error instanceof FarfieldError && error.code === 'not-found';
        this.dispatchEvent({ type: 'cell-error', cell, error, absent });
      },
    });
  }

  /** Have the cell table around the eye, if it is paged. */
  private ensure(eye: Vec3): void {
    const { index } = this;
    if (index === undefined) return;
    const reach = 4 * Math.max(...index.grid.size);
    const at = this.ensuredAt;
    if (at !== undefined && new Vector3(...eye).distanceTo(new Vector3(...at)) < reach / 4) return;
    this.ensuredAt = eye;
    const retry = (): void => {
      // The walker may have gone on meanwhile; the next frame asks again.
      setTimeout(() => (this.ensuredAt = undefined), 2000);
    };
    Promise.all([index.ensureNearest(eye), index.ensure(eye, reach)]).catch(retry);
  }

  private readonly onContextLost = (event: Event): void => {
    event.preventDefault();
    this.objects.forget();
    this.fade.end();
    // Everything on the graphics card is gone, and can only be let go of before a new context comes.
    this.stage?.dispose();
    this.stage = undefined;
    this.shownView = undefined;
    this.shown = undefined;
    this.dispatchEvent({ type: 'context-lost' });
  };

  private readonly onContextRestored = (): void => {
    this.build();
    this.dispatchEvent({ type: 'context-restored' });
  };

  private readonly onOnline = (): void => {
    this.ensuredAt = undefined;
    this.retry();
  };
}
