/** What a walk is made of, drawn over it: a tint for each quad or layer, outlines, the near border. */

import type { Walk } from '../walk.js';
import {
  BoxGeometry,
  BufferGeometry,
  DoubleSide,
  EdgesGeometry,
  GLSL3,
  LessEqualDepth,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  RawShaderMaterial,
  type BufferAttribute,
} from 'three';
import { quadOf } from '../far-material.js';
import { CLIP_GLSL } from '../projection.js';

const OUTLINE_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec4 position;
${CLIP_GLSL}
void main() {
  gl_Position = ff_clip(projectionMatrix, modelViewMatrix * position);
  // A hair nearer than the quad, or the line would flicker in it.
  gl_Position.z -= 1e-5 * gl_Position.w;
}
`;
const OUTLINE_FRAGMENT = `
precision mediump float;
out vec4 color;
void main() { color = vec4(1.0, 1.0, 1.0, 1.0); }
`;

export class Overlays {
  /** Give every quad a colour of its own; quads of one layer share one. */
  tint = false;
  outlines = false;
  /** Show the cube between near polygons and quads. */
  border = false;
  private readonly walk: Walk;
  private readonly lineMaterial = new RawShaderMaterial({
    name: 'farfield outlines',
    glslVersion: GLSL3,
    vertexShader: OUTLINE_VERTEX,
    fragmentShader: OUTLINE_FRAGMENT,
    depthFunc: LessEqualDepth,
    depthWrite: false,
    toneMapped: false,
  });
  private lines: LineSegments | undefined;
  private linesOf: BufferGeometry | undefined;
  private cube: Mesh | undefined;

  constructor(walk: Walk) {
    this.walk = walk;
  }

  /** Call once a frame, after the walk's own `update`. */
  update(): void {
    const { view } = this.walk;
    const material = view?.far?.material;
    if (material !== undefined && this.tint !== (material.defines.TINT !== undefined)) {
      const layered = (this.walk.manifest?.walk.layers.length ?? 0) > 0;
      if (this.tint) material.defines.TINT = layered ? 2 : 1;
      else delete material.defines.TINT;
      material.needsUpdate = true;
    }
    const geometry = this.outlines ? view?.far?.geometry : undefined;
    if (geometry !== this.linesOf) this.outline(geometry);
    if (this.lines !== undefined && view !== undefined) {
      this.lines.position.copy(view.group.position);
      this.lines.visible = view.group.visible;
    }
    if (this.border && this.cube === undefined) this.cube = this.createCube();
    if (this.cube !== undefined) {
      this.cube.visible = this.border && view?.group.visible === true;
      if (view !== undefined) this.cube.position.copy(view.group.position);
    }
  }

  dispose(): void {
    this.outline(undefined);
    this.lineMaterial.dispose();
    this.cube?.removeFromParent();
    this.cube?.geometry.dispose();
  }

  private outline(geometry: BufferGeometry | undefined): void {
    this.lines?.removeFromParent();
    // Its vertices are the quads' own and must not be let go with it.
    this.lines?.geometry.deleteAttribute('position');
    this.lines?.geometry.dispose();
    this.lines = undefined;
    this.linesOf = geometry;
    if (geometry === undefined) return;
    const outline = new BufferGeometry();
    outline.setAttribute('position', geometry.getAttribute('position'));
    outline.setIndex(edges(geometry.getAttribute('texel') as BufferAttribute));
    this.lines = new LineSegments(outline, this.lineMaterial);
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1.5;
    this.lines.raycast = () => undefined;
    this.walk.group.add(this.lines);
  }

  private createCube(): Mesh {
    const side = 2 * (this.walk.manifest?.walk.near_field ?? 0);
    const box = new BoxGeometry(side, side, side);
    const cube = new Mesh(
      box,
      new MeshBasicMaterial({
        color: 0xffb347,
        opacity: 0.14,
        transparent: true,
        side: DoubleSide,
        depthWrite: false,
        toneMapped: false,
      }),
    );
    const rim = new LineSegments(
      new EdgesGeometry(box),
      new LineBasicMaterial({ color: 0xffb347, toneMapped: false }),
    );
    rim.frustumCulled = false;
    cube.frustumCulled = false;
    cube.renderOrder = 3;
    cube.raycast = () => undefined;
    cube.add(rim);
    this.walk.group.add(cube);
    return cube;
  }
}

/** Pairs of vertices that are neighbours on the rim of a quad. */
function edges(texel: BufferAttribute): number[] {
  const pairs: number[] = [];
  for (let first = 0; first < texel.count;) {
    let end = first + 1;
    while (end < texel.count && quadOf(texel.getZ(end)) === quadOf(texel.getZ(first))) end++;
    for (let n = first; n < end; n++) pairs.push(n, n + 1 < end ? n + 1 : first);
    first = end;
  }
  return pairs;
}
