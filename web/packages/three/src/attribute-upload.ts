/**
 * Uploads vertex and index buffers before they are drawn. three.js creates a buffer when an object
 * that has it is first drawn; the carriers here draw nothing but hold the buffers that are due, so
 * a cell's buffers arrive over several frames and its first visible frame uploads nothing.
 */

import type { UploadScheduler, UploadStep, User } from '@farfield/core';
import { BufferGeometry, GLSL3, Group, Mesh, RawShaderMaterial, Sphere } from 'three';
import type { BufferAttribute } from 'three';

export class AttributeUpload {
  /** Must be in the scene that is drawn. */
  readonly group = new Group();
  private readonly uploads: UploadScheduler;
  private readonly carriers: Mesh[] = [];
  private readonly material = new RawShaderMaterial({
    name: 'farfield upload',
    glslVersion: GLSL3,
    vertexShader: 'void main() { gl_Position = vec4(0.0, 0.0, 2.0, 1.0); }',
    fragmentShader: 'precision mediump float; out vec4 color; void main() { color = vec4(0.0); }',
  });
  private attributes: BufferAttribute[] = [];
  private indices: BufferAttribute[] = [];
  private drawn: (() => void)[] = [];
  private carrying = false;

  constructor(uploads: UploadScheduler) {
    this.uploads = uploads;
    this.group.name = 'farfield upload';
  }

  /** Upload the buffers of some geometries; settles after a frame has drawn them all. */
  async add(geometries: readonly BufferGeometry[], user: User, signal: AbortSignal): Promise<void> {
    await this.uploads.add(this.steps(geometries), user.priority, signal);
    await new Promise<void>((resolve) => this.drawn.push(resolve));
  }

  /** Hang what has become due on carriers; call once a frame, after uploads and before drawing. */
  update(): void {
    // A frame that was not drawn leaves its buffers due.
    if (this.carrying) return;
    const count = Math.max(
      this.indices.length,
      this.drawn.length + this.attributes.length > 0 ? 1 : 0,
    );
    while (this.carriers.length < count) this.carriers.push(this.carrier());
    for (const [n, child] of this.carriers.entries()) {
      const { geometry } = child;
      for (const name of Object.keys(geometry.attributes)) geometry.deleteAttribute(name);
      geometry.setIndex(this.indices.at(n) ?? null);
      child.visible = n < count;
    }
    if (count === 0) return;
    const first = this.carriers[0];
    this.attributes.forEach((attribute, n) => first.geometry.setAttribute(`due${n}`, attribute));
    this.carrying = true;
    const { drawn } = this;
    this.attributes = [];
    this.indices = [];
    this.drawn = [];
    const last = this.carriers[count - 1];
    last.onAfterRender = () => {
      last.onAfterRender = () => undefined;
      this.carrying = false;
      for (const done of drawn) done();
    };
  }

  dispose(): void {
    for (const child of this.carriers) {
      for (const name of Object.keys(child.geometry.attributes)) {
        child.geometry.deleteAttribute(name);
      }
      child.geometry.setIndex(null);
      child.geometry.dispose();
    }
    this.group.clear();
    this.material.dispose();
  }

  private carrier(): Mesh {
    const mesh = new Mesh(new BufferGeometry(), this.material);
    mesh.geometry.setDrawRange(0, 0);
    mesh.geometry.boundingSphere = new Sphere();
    mesh.frustumCulled = false;
    mesh.raycast = () => undefined;
    this.group.add(mesh);
    return mesh;
  }

  private *steps(geometries: readonly BufferGeometry[]): Generator<UploadStep> {
    for (const { attributes, index } of geometries) {
      for (const attribute of Object.values(attributes) as BufferAttribute[]) {
        yield {
          bytes: attribute.array.byteLength,
          run: () => this.attributes.push(attribute),
        };
      }
      if (index !== null) {
        yield { bytes: index.array.byteLength, run: () => this.indices.push(index) };
      }
    }
  }
}
