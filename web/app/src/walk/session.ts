/** One visit to a walk: renderer, camera, walker and the frame loop. */

import { FetchQueue, ZipSource, cellDistance, type Vec3 } from '@farfield/core';
import { Walk, setInfiniteFar } from '@farfield/three';
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { formatPose, parsePose, type Pose } from './address.js';
import { Controls } from './controls.js';
import { STILL, Walker, type Intent } from './walker.js';

const FOV = 60;
/** Beyond this distance from the shown cell, in cells, the walker waits for the next one. */
const LEASH = 0.75;

export interface SessionOptions {
  readonly canvas: HTMLCanvasElement;
  readonly manifestUrl: string;
  readonly capture: boolean;
  readonly textureBytes: number;
}

/** A walk in a zip is read out of it. */
function zipOf(url: string): ZipSource | undefined {
  return new URL(url).pathname.endsWith('.zip') ? new ZipSource(url) : undefined;
}

export class Session {
  readonly renderer: WebGLRenderer;
  readonly camera: PerspectiveCamera;
  readonly walk: Walk;
  readonly walker = new Walker();
  readonly controls: Controls;
  /** Milliseconds of the last frames, newest last. */
  readonly frameTimes: number[] = [];
  /** Called after every drawn frame. */
  onFrame: () => void = () => undefined;
  readonly capture: boolean;
  private readonly scene = new Scene();
  private readonly canvas: HTMLCanvasElement;
  private last = 0;
  private running = 0;
  private linkTimer = 0;

  constructor(options: SessionOptions) {
    const { canvas, capture } = options;
    this.canvas = canvas;
    this.capture = capture;
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: false,
      alpha: capture,
      stencil: false,
      powerPreference: 'high-performance',
      preserveDrawingBuffer: capture,
    });
    this.renderer.setClearColor(0x000000, capture ? 0 : 1);
    this.camera = new PerspectiveCamera(FOV, 1, 0.1, 1000);
    this.camera.rotation.order = 'YXZ';
    const zip = zipOf(options.manifestUrl);
    this.walk = new Walk(zip?.manifestUrl ?? options.manifestUrl, {
      ...(zip === undefined ? {} : { queue: new FetchQueue({ fetch: zip.fetch }) }),
      renderer: this.renderer,
      backgroundAlpha: capture ? 0 : 1,
      textureBytes: options.textureBytes,
    });
    this.scene.add(this.walk.group);
    this.walk.setCamera(this.camera);
    this.controls = new Controls(canvas);
    this.walker.direct = capture || window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.walk.loaded.then(
      (manifest) => {
        const { start, grid } = manifest.walk;
        this.walker.place(parsePose(location.hash) ?? start);
        if (this.walk.index !== undefined && !capture) this.walker.enter(this.walk.index);
        this.camera.near = 0.01 * Math.min(...grid.size);
        this.resize();
        this.start();
      },
      () => undefined,
    );
    window.addEventListener('hashchange', this.onHash);
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Begin to draw frame after frame. */
  start(): void {
    if (this.running !== 0) return;
    const loop = (now: number): void => {
      this.running = requestAnimationFrame(loop);
      this.tick(now);
    };
    this.running = requestAnimationFrame(loop);
  }

  /** Stop drawing; `draw` still works. */
  stop(): void {
    cancelAnimationFrame(this.running);
    this.running = 0;
  }

  /** Put the walker somewhere, exactly. */
  place(pose: Pose): void {
    this.walker.place(pose);
  }

  /** Move by an intent for some seconds, as controls do. */
  step(seconds: number, intent: Intent): void {
    const { index } = this.walk;
    if (index !== undefined) this.walker.step(seconds, intent, index, this.brake);
  }

  /** Stream and draw one frame. */
  draw(): void {
    const { eye, yaw, pitch } = this.walker;
    this.camera.position.set(...eye);
    this.camera.rotation.set(pitch, yaw, 0);
    this.walk.update();
    this.renderer.render(this.scene, this.camera);
    this.onFrame();
  }

  dispose(): void {
    this.stop();
    window.removeEventListener('hashchange', this.onHash);
    this.controls.dispose();
    this.walk.dispose();
    this.renderer.dispose();
  }

  private tick(now: number): void {
    const seconds = Math.min(0.1, (now - this.last) / 1000);
    if (this.last !== 0) {
      this.frameTimes.push(now - this.last);
      if (this.frameTimes.length > 120) this.frameTimes.shift();
    }
    this.last = now;
    const intent = this.controls.read(seconds);
    this.step(seconds, this.capture ? STILL : intent);
    this.draw();
    if (!this.capture && now - this.linkTimer > 1000) {
      this.linkTimer = now;
      this.writeLink();
    }
  }

  /** How freely a step may be taken: less the farther it leads from the cell that is shown. */
  private readonly brake = (to: Vec3): number => {
    const { cell, index } = this.walk;
    if (cell === undefined || index === undefined) return 0;
    const before = cellDistance(cell, this.walker.eye);
    const after = cellDistance(cell, to);
    if (after <= before) return 1;
    return Math.max(0, 1 - after / (LEASH * index.cellSize));
  };

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(this.capture ? 1 : Math.min(window.devicePixelRatio, 1.5));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    setInfiniteFar(this.camera);
    // A resized canvas is empty until something is drawn.
    if (this.running !== 0) this.draw();
  }

  private readonly onHash = (): void => {
    const pose = parsePose(location.hash);
    if (pose === undefined) return;
    this.walker.place(pose);
    if (this.walk.index !== undefined && !this.capture) this.walker.enter(this.walk.index);
  };

  /** Keep the address such that a reload or a shared link comes back here. */
  private writeLink(): void {
    const hash = formatPose(this.walker.pose);
    if (hash !== location.hash) history.replaceState(history.state, '', hash);
  }
}
