/** One visit to a walk: renderer, camera, walker and the frame loop. */

import { FetchQueue, ZipSource, cellDistance, type Vec3 } from '@farfield/core';
import { Walk, setInfiniteFar, type NearImpostors } from '@farfield/three';
import { Overlays } from '@farfield/three/overlays';
import { Group, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { Comparison } from './comparison.js';
import { formatPose, parsePose, type Pose } from './address.js';
import { Controls } from './controls.js';
import { Recorder, poseAt, type PathFile } from './path.js';
import { EYE, STILL, Walker, metre, type Intent } from './walker.js';
import { Headset } from './xr.js';

const FOV = 60;
/** Beyond this distance from the shown cell, in cells, the walker waits for the next one. */
const LEASH = 0.75;

export interface SessionOptions {
  readonly canvas: HTMLCanvasElement;
  readonly manifestUrl: string;
  readonly capture: boolean;
  readonly textureBytes: number;
  /** Seconds in which one cell fades into the next. */
  readonly fade: number;
  /** How costly objects of the near field are drawn. */
  readonly near: NearImpostors;
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
  readonly comparison: Comparison;
  readonly overlays: Overlays;
  readonly headset: Headset;
  /** Poses are collected while this is set. */
  recorder: Recorder | undefined;
  /** A path being played back, and how far it has come, in poses. */
  playback: { readonly path: PathFile; at: number } | undefined;
  /** Milliseconds of the last frames, newest last. */
  readonly frameTimes: number[] = [];
  /** Called after every drawn frame. */
  onFrame: () => void = () => undefined;
  readonly capture: boolean;
  private readonly scene = new Scene();
  /** What the camera hangs on; it moves only while a headset moves the camera. */
  private readonly rig = new Group();
  private readonly canvas: HTMLCanvasElement;
  private last = 0;
  private running = false;
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
      fade: options.fade,
      nearImpostors: options.near,
    });
    this.scene.add(this.walk.group);
    this.walk.setCamera(this.camera);
    this.scene.add(this.rig);
    this.headset = new Headset(this.renderer, this.rig, this.camera);
    this.overlays = new Overlays(this.walk);
    this.comparison = new Comparison(this.renderer, this.scene, this.walk);
    this.controls = new Controls(canvas);
    this.walker.direct = capture || window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.walk.loaded.then(
      (manifest) => {
        const { start, grid } = manifest.walk;
        const asked = parsePose(location.hash);
        this.walker.place(asked ?? start);
        if (asked === undefined && !capture) this.walker.land();
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
    if (this.running) return;
    this.running = true;
    this.renderer.setAnimationLoop((now) => this.tick(now));
  }

  /** Stop drawing; `draw` still works. */
  stop(): void {
    this.running = false;
    this.renderer.setAnimationLoop(null);
  }

  /** Put the walker somewhere, exactly. */
  place(pose: Pose): void {
    this.walker.place(pose);
  }

  /** Move by an intent for some seconds, as controls do. */
  step(seconds: number, intent: Intent): void {
    const { index } = this.walk;
    if (index === undefined) return;
    const { solid, topSpeed } = this.walk;
    // Scripts and pictures go where they are told to, not where the ground is.
    const around = this.capture ? {} : { solid, topSpeed };
    this.walker.step(seconds, intent, { index, brake: this.brake, ...around });
  }

  /** Stream and draw one frame. */
  draw(): void {
    this.setCamera();
    this.comparison.draw(this.camera, () => this.overlays.update());
    this.onFrame();
  }

  /** Play a path from its beginning. */
  play(path: PathFile): void {
    this.playback = { path, at: 0 };
    this.walker.place(poseAt(path, 0));
  }

  dispose(): void {
    this.stop();
    this.overlays.dispose();
    window.removeEventListener('hashchange', this.onHash);
    this.controls.dispose();
    this.comparison.dispose();
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
    if (this.playback === undefined) this.step(seconds, this.capture ? STILL : intent);
    else this.follow(seconds, intent);
    this.recorder?.step(seconds, this.walker.pose);
    this.draw();
    if (!this.capture && now - this.linkTimer > 1000) {
      this.linkTimer = now;
      this.writeLink();
    }
  }

  /** Go on along the path that is played, unless a person takes over or its cells are not there. */
  private follow(seconds: number, intent: Intent): void {
    const { playback } = this;
    if (playback === undefined) return;
    const { path } = playback;
    const taken = intent.right !== 0 || intent.forward !== 0 || intent.up !== 0;
    if (taken || playback.at >= path.poses.length - 1) {
      this.playback = undefined;
      return;
    }
    const next = poseAt(path, playback.at + path.rate * seconds * this.walker.pace);
    const free = this.brake(next.eye);
    playback.at += path.rate * seconds * this.walker.pace * free;
    this.walker.place(poseAt(path, playback.at));
  }

  private setCamera(): void {
    const { eye, yaw, pitch } = this.walker;
    const size = this.walk.index?.grid.size;
    if (!this.headset.active || size === undefined) {
      this.rig.position.set(0, 0, 0);
      this.rig.rotation.set(0, 0, 0);
      this.rig.scale.setScalar(1);
      this.camera.position.set(...eye);
      this.camera.rotation.set(pitch, yaw, 0);
      return;
    }
    // The headset measures from the floor, in metres.
    const unit = metre(Math.min(size[0], size[2]));
    this.rig.position.set(eye[0], eye[1] - EYE * unit, eye[2]);
    this.rig.rotation.set(0, yaw, 0);
    this.rig.scale.setScalar(unit);
  }

  /** How freely a step may be taken: less the farther it leads from the cell that is shown. */
  readonly brake = (to: Vec3): number => {
    const { cell, index } = this.walk;
    if (cell === undefined || index === undefined) return 0;
    if (this.walk.frozen) return 1;
    const before = cellDistance(cell, this.walker.eye);
    const after = cellDistance(cell, to);
    if (after <= before) return 1;
    return Math.max(0, 1 - after / (LEASH * index.cellSize));
  };

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0 || this.headset.active) return;
    this.renderer.setPixelRatio(this.capture ? 1 : Math.min(window.devicePixelRatio, 1.5));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    setInfiniteFar(this.camera);
    // A resized canvas is empty until something is drawn.
    if (this.running) this.draw();
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
