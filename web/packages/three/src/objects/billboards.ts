/** All billboards of one atlas as instances of one quad: one draw call, back to front, blended. */

import {
  BufferAttribute,
  Color,
  DoubleSide,
  GLSL3,
  InstancedBufferGeometry,
  InstancedInterleavedBuffer,
  DynamicDrawUsage,
  InterleavedBufferAttribute,
  Mesh,
  Sphere,
  ShaderMaterial,
  type Texture,
} from 'three';
import type { Slot } from '@farfield/core';
import type { Vector3 } from 'three';
import { CLIP_GLSL } from '../projection.js';

const VERTEX = `
in vec4 ff_centre; // world space; weight
in vec4 ff_right;  // half the width; lower left texel, x
in vec4 ff_up;     // half the height; lower left texel, y
in float ff_size;  // edge of the slot, texels
uniform float ff_atlas;
out vec2 v_uv;
out float v_weight;
#ifdef USE_FOG
out float v_depth;
#endif
${CLIP_GLSL}
void main() {
  vec2 corner = position.xy;
  vec3 at = ff_centre.xyz + corner.x * ff_right.xyz + corner.y * ff_up.xyz;
  vec4 seen = viewMatrix * vec4(at, 1.0);
  v_uv = (vec2(ff_right.w, ff_up.w) + (0.5 + 0.5 * corner) * ff_size) / ff_atlas;
  v_weight = ff_centre.w;
#ifdef USE_FOG
  v_depth = -seen.z;
#endif
  gl_Position = ff_clip(projectionMatrix, seen);
}
`;

const FRAGMENT = `
uniform sampler2D ff_pictures;
in vec2 v_uv;
in float v_weight;
out vec4 color;
#ifdef USE_FOG
in float v_depth;
uniform vec3 fogColor;
#ifdef FOG_EXP2
uniform float fogDensity;
#else
uniform float fogNear;
uniform float fogFar;
#endif
#endif
void main() {
  // Colours are multiplied by alpha, so filtering at an outline mixes in nothing foreign.
  color = v_weight * texture(ff_pictures, v_uv);
  if (color.a < 1.0 / 512.0) discard;
#ifdef USE_FOG
#ifdef FOG_EXP2
  float fog = 1.0 - exp(-fogDensity * fogDensity * v_depth * v_depth);
#else
  float fog = smoothstep(fogNear, fogFar, v_depth);
#endif
  // three.js lays fog over encoded colours; here they are multiplied by alpha as well.
  color.rgb = mix(color.rgb, color.a * fogColor, fog);
#endif
}
`;

/** One billboard as it is drawn in this frame. */
export interface Instance {
  readonly centre: Vector3;
  readonly right: Vector3;
  readonly up: Vector3;
  readonly slot: Slot;
  readonly weight: number;
  /** From the eye, for sorting. */
  readonly distance: number;
  /** Of equally distant ones, which is drawn first. */
  readonly order: number;
}

const FLOATS = 13;

export class Billboards {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private buffer: InstancedInterleavedBuffer;

  constructor(pictures: Texture, atlas: number) {
    this.buffer = makeBuffer(64);
    const material = new ShaderMaterial({
      name: 'farfield impostors',
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        ff_pictures: { value: pictures },
        ff_atlas: { value: atlas },
        fogColor: { value: new Color() },
        fogDensity: { value: 0 },
        fogNear: { value: 0 },
        fogFar: { value: 1 },
      },
      transparent: true,
      premultipliedAlpha: true,
      depthWrite: false,
      side: DoubleSide,
      fog: true,
      toneMapped: false,
    });
    this.mesh = new Mesh(makeGeometry(this.buffer), material);
    this.mesh.name = 'farfield impostors';
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.renderOrder = 3;
    this.mesh.raycast = () => undefined;
  }

  /** What to draw from now on; sorts `instances` back to front. */
  write(instances: Instance[]): void {
    const { mesh } = this;
    mesh.visible = instances.length > 0;
    if (!mesh.visible) return;
    instances.sort((a, b) => b.distance - a.distance || a.order - b.order);
    if (instances.length > this.buffer.count) this.grow(instances.length);
    const { array } = this.buffer;
    instances.forEach(({ centre, right, up, slot, weight }, n) => {
      const at = FLOATS * n;
      centre.toArray(array, at);
      array[at + 3] = weight;
      right.toArray(array, at + 4);
      array[at + 7] = slot.x;
      up.toArray(array, at + 8);
      array[at + 11] = slot.y;
      array[at + 12] = slot.size;
    });
    this.buffer.clearUpdateRanges();
    this.buffer.addUpdateRange(0, FLOATS * instances.length);
    this.buffer.needsUpdate = true;
    mesh.geometry.instanceCount = instances.length;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private grow(count: number): void {
    this.mesh.geometry.dispose();
    this.buffer = makeBuffer(2 ** Math.ceil(Math.log2(count)));
    this.mesh.geometry = makeGeometry(this.buffer);
  }
}

function makeBuffer(count: number): InstancedInterleavedBuffer {
  const buffer = new InstancedInterleavedBuffer(new Float32Array(FLOATS * count), FLOATS);
  buffer.setUsage(DynamicDrawUsage);
  return buffer;
}

function makeGeometry(buffer: InstancedInterleavedBuffer): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
  geometry.setAttribute('position', new BufferAttribute(corners, 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  geometry.setAttribute('ff_centre', new InterleavedBufferAttribute(buffer, 4, 0));
  geometry.setAttribute('ff_right', new InterleavedBufferAttribute(buffer, 4, 4));
  geometry.setAttribute('ff_up', new InterleavedBufferAttribute(buffer, 4, 8));
  geometry.setAttribute('ff_size', new InterleavedBufferAttribute(buffer, 1, 12));
  geometry.boundingSphere = new Sphere(undefined, Infinity);
  return geometry;
}
