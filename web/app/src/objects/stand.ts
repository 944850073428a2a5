/** What all example pages stand on: renderer, camera, frame loop, and timing with a fence. */

import { PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';
import { setInfiniteFar } from '@farfield/three';

export interface Show {
  readonly title: string;
  /** Bring the scene to a moment, seconds, before it is drawn. */
  frame: (seconds: number) => void;
  /** Where the camera is when it moves by itself. */
  path?: (seconds: number) => { eye: Vector3; at: Vector3 };
  /** What scripts drive. */
  readonly hooks?: Record<string, unknown>;
}

export class Stand {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(60, 1, 0.1, 5000);
  readonly driver: string;
  private readonly gl: WebGL2RenderingContext;
  private show: Show | undefined;

  constructor(canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: false,
      powerPreference: 'high-performance',
      preserveDrawingBuffer: true,
    });
    this.gl = this.renderer.getContext() as WebGL2RenderingContext;
    const info = this.gl.getExtension('WEBGL_debug_renderer_info');
    this.driver = String(this.gl.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? this.gl.RENDERER));
    const resize = (): void => {
      const { clientWidth, clientHeight } = canvas;
      this.renderer.setPixelRatio(1);
      this.renderer.setSize(clientWidth, clientHeight, false);
      this.camera.aspect = clientWidth / clientHeight;
      this.camera.updateProjectionMatrix();
      setInfiniteFar(this.camera);
    };
    resize();
    new ResizeObserver(resize).observe(canvas);
  }

  begin(show: Show): void {
    this.show = show;
  }

  /** Put the camera somewhere and turn it. */
  look(eye: readonly number[], at: readonly number[]): void {
    this.camera.position.set(eye[0], eye[1], eye[2]);
    this.camera.lookAt(at[0], at[1], at[2]);
    this.camera.updateMatrixWorld();
  }

  /** Draw the moment `seconds`. */
  draw(seconds: number): void {
    this.show?.frame(seconds);
    this.renderer.render(this.scene, this.camera);
  }

  /** Draw a moment with the camera on its path. */
  drawOnPath(seconds: number): void {
    const pose = this.show?.path?.(seconds);
    if (pose !== undefined) this.look(pose.eye.toArray(), pose.at.toArray());
    this.draw(seconds);
  }

  /** Milliseconds of each of some frames on the path, ended by a fence: a pixel read back. */
  measure(from: number, frames: number, step: number): number[] {
    const pixel = new Uint8Array(4);
    const fence = (): void => {
      this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, pixel);
    };
    fence();
    return Array.from({ length: frames }, (_, n) => {
      const start = performance.now();
      this.drawOnPath(from + n * step);
      fence();
      return performance.now() - start;
    });
  }

  /** The picture, RGBA, top row first, as base64. */
  pixels(): { width: number; height: number; data: string } {
    const { width, height } = this.renderer.domElement;
    const bottomUp = new Uint8Array(4 * width * height);
    this.gl.readPixels(0, 0, width, height, this.gl.RGBA, this.gl.UNSIGNED_BYTE, bottomUp);
    let data = '';
    for (let row = height - 1; row >= 0; row--) {
      data += String.fromCharCode(...bottomUp.subarray(4 * width * row, 4 * width * (row + 1)));
    }
    return { width, height, data: btoa(data) };
  }
}
