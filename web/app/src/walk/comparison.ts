/** The walk, the full model, or both side by side with a divider between them. */

import type { FullModel } from '@farfield/three/full-model';
import type { Walk } from '@farfield/three';
import { Vector2, type Camera, type Scene, type WebGLRenderer } from 'three';

/** Where the full model of a walk lies: at the API, or in the store that the walk is part of. */
export function modelUrl(walkUrl: string, scene: string): string {
  const api = /^(.*\/api\/v1\/)walks\/[^/]+\/walk\.json$/.exec(walkUrl.split('?')[0]);
  return api === null
    ? new URL(`../../scenes/${scene}/prepared/`, walkUrl).href
    : `${api[1]}scenes/${scene}/prepared/`;
}

/** More triangles than this are not offered for comparison. */
export const MOST_TRIANGLES = 2_000_000;

export class Comparison {
  /** What is drawn: both sides only once the model is there. */
  mode: 'walk' | 'full' | 'split' = 'walk';
  /** Where the divider is, 0 to 1: the walk to its left, the model to its right. */
  divider = 0.5;
  state: 'none' | 'loading' | 'ready' | 'failed' = 'none';
  error: Error | undefined;
  private model: FullModel | undefined;
  private readonly renderer: WebGLRenderer;
  private readonly scene: Scene;
  private readonly walk: Walk;

  constructor(renderer: WebGLRenderer, scene: Scene, walk: Walk) {
    this.renderer = renderer;
    this.scene = scene;
    this.walk = walk;
    // Its buffers are gone with the context; asking again loads it anew.
    walk.addEventListener('context-lost', () => this.clear());
  }

  /** Whether there is a model small enough to load. */
  get offered(): boolean {
    const triangles = this.walk.manifest?.walk.scene.triangles ?? Infinity;
    return triangles <= MOST_TRIANGLES;
  }

  /** Triangles of the model, once it is there. */
  get triangles(): number {
    return this.model?.triangles ?? 0;
  }

  /** Load the model in so many chunks; what was loaded before is let go. */
  async load(chunks = 64): Promise<void> {
    const { manifest } = this.walk;
    if (manifest === undefined) return;
    this.clear();
    this.state = 'loading';
    const module = await import('@farfield/three/full-model');
    const model = new module.FullModel(modelUrl(manifest.url, manifest.walk.scene.id), {
      light: manifest.walk.light,
      chunks,
      most: MOST_TRIANGLES,
    });
    this.model = model;
    try {
      await model.loaded;
      if (this.model !== model) return;
      model.group.visible = false;
      this.scene.add(model.group);
      this.state = 'ready';
    } catch (error) {
      if (this.model !== model) return;
      this.state = 'failed';
      this.mode = 'walk';
      this.error = error instanceof Error ? error : new Error(String(error));
    }
  }

  /** Draw a frame; `beside` is called once the walk is up to date. */
  draw(camera: Camera, beside: () => void): void {
    const { model, renderer, walk } = this;
    const mode = this.state === 'ready' ? this.mode : 'walk';
    if (mode !== 'split' || model === undefined) {
      walk.visible = mode === 'walk';
      if (model !== undefined) model.group.visible = mode === 'full';
      walk.update();
      beside();
      renderer.render(this.scene, camera);
      return;
    }
    const { x: width, y: height } = renderer.getSize(new Vector2());
    const at = Math.round(this.divider * width);
    renderer.setScissorTest(true);
    renderer.setScissor(0, 0, at, height);
    walk.visible = true;
    model.group.visible = false;
    walk.update();
    beside();
    renderer.render(this.scene, camera);
    renderer.setScissor(at, 0, width - at, height);
    walk.visible = false;
    model.group.visible = true;
    walk.showCells();
    beside();
    renderer.render(this.scene, camera);
    renderer.setScissorTest(false);
  }

  dispose(): void {
    this.clear();
  }

  private clear(): void {
    this.model?.dispose();
    this.model = undefined;
    this.state = 'none';
    this.mode = 'walk';
    this.error = undefined;
  }
}
