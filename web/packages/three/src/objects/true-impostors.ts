/** Many instances of one true impostor, in one draw call. */

import {
  FarfieldError,
  backToFront,
  objectLayers,
  parseObject,
  type Light,
  type ObjectFile,
} from '@farfield/core';
import {
  BufferAttribute,
  DataArrayTexture,
  DoubleSide,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LessDepth,
  Matrix3,
  Mesh,
  NearestFilter,
  RawShaderMaterial,
  RGBAFormat,
  Sphere,
  UnsignedByteType,
  Vector2,
  Vector3,
  type Camera,
  type IUniform,
  type WebGLRenderer,
} from 'three';
import { lightUniforms, type Uniforms } from '../light.js';
import { TRUE_FRAGMENT, TRUE_VERTEX } from './true-shader.js';

/** A baked object, ready to be drawn. */
export interface BakedObject {
  readonly file: ObjectFile;
  readonly texture: DataArrayTexture;
}

export interface TrueImpostorOptions {
  /** Default `opaque`. `glass` bends light at every surface, `translucent` lets it through. */
  readonly kind?: 'opaque' | 'translucent' | 'glass';
  /** Constants of the light model, or their uniforms. */
  readonly light: Light | Uniforms;
  /** Shadows that an opaque object casts on itself. Default false. */
  readonly shadow?: boolean;
  /** Share of light that an opaque object mirrors. Default 0. */
  readonly reflect?: number;
  /** Index of refraction of glass. Default 1.5. */
  readonly index?: number;
  /** Light lost per metre, for glass and what is translucent. Default 0.3. */
  readonly absorb?: readonly [number, number, number];
  /** Most steps of a ray. Default 96. */
  readonly steps?: number;
  /** Steps for each pixel that the object is across. Default 0.75. */
  readonly stepsPerPixel?: number;
  /** The cell fade of the walk that it is part of. */
  readonly fade?: IUniform<number>;
}

/** Load what `farfield bake-object` has written; throws FarfieldError 'format'. */
export async function loadObject(url: string): Promise<BakedObject> {
  const file = parseObject(await (await fetch(url)).text());
  const image = await fetch(new URL(file.image, new URL(url, location.href)));
  return decodeObject(file, await image.arrayBuffer());
}

/** The object of a file whose picture is these bytes; throws FarfieldError 'format'. */
export async function decodeObject(file: ObjectFile, png: ArrayBuffer): Promise<BakedObject> {
  // Heights are numbers: no colour space, no alpha, nothing may touch them.
  const bitmap = await createImageBitmap(new Blob([png], { type: 'image/png' }), {
    colorSpaceConversion: 'none',
    premultiplyAlpha: 'none',
  });
  const { resolution } = file;
  const layers = objectLayers(file);
  if (bitmap.width !== resolution || bitmap.height !== resolution * layers) {
    throw new FarfieldError('format', "An object's picture has not the size that its file says.");
  }
  const data = readBytes(bitmap);
  const fields = new DataArrayTexture(data, resolution, resolution, layers);
  fields.format = RGBAFormat;
  fields.type = UnsignedByteType;
  fields.minFilter = fields.magFilter = NearestFilter;
  fields.needsUpdate = true;
  return { file, texture: fields };
}

let reader: WebGL2RenderingContext | undefined;

/** The bytes of a picture, RGBA. A 2D canvas would multiply colours by alpha; a texture does not. */
function readBytes(bitmap: ImageBitmap): Uint8Array<ArrayBuffer> {
  // One context for all: browsers allow few, and drop the oldest.
  if (reader === undefined || reader.isContextLost()) {
    reader = new OffscreenCanvas(1, 1).getContext('webgl2') ?? undefined;
  }
  if (reader === undefined) throw new FarfieldError('unsupported', 'Objects need WebGL 2.');
  const gl = reader;
  const [texture, frame] = [gl.createTexture(), gl.createFramebuffer()];
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  const data = new Uint8Array(4 * bitmap.width * bitmap.height);
  gl.readPixels(0, 0, bitmap.width, bitmap.height, gl.RGBA, gl.UNSIGNED_BYTE, data);
  gl.deleteFramebuffer(frame);
  gl.deleteTexture(texture);
  bitmap.close();
  return data;
}

export class TrueImpostors extends Mesh<InstancedBufferGeometry, RawShaderMaterial> {
  private readonly places: Float32Array<ArrayBuffer>;
  private readonly turns: Float32Array<ArrayBuffer>;
  private readonly sorted: boolean;

  /**
   * @param places 4 numbers per instance: where the object's origin is, and its scale
   * @param turns 4 numbers per instance: a unit quaternion
   */
  constructor(
    { file, texture }: BakedObject,
    places: Float32Array<ArrayBuffer>,
    turns: Float32Array<ArrayBuffer>,
    options: TrueImpostorOptions,
  ) {
    const kind = options.kind ?? 'opaque';
    super(makeGeometry(places, turns), makeMaterial(file, texture, kind, options));
    this.places = places;
    this.turns = turns;
    this.sorted = kind === 'translucent';
    this.frustumCulled = false;
    this.raycast = () => undefined;
    this.name = `farfield ${file.name}`;
    this.onBeforeRender = (renderer, _, camera) => this.prepare(renderer, camera);
  }

  override dispose(): void {
    this.removeFromParent();
    this.geometry.dispose();
    this.material.dispose();
  }

  private prepare(renderer: WebGLRenderer, camera: Camera): void {
    const { uniforms } = this.material;
    const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    eye.applyMatrix4(this.matrixWorld.clone().invert());
    (uniforms.ff_eye.value as Vector3).copy(eye);
    const { height } = renderer.getDrawingBufferSize(new Vector2());
    uniforms.ff_focal.value = (camera.projectionMatrix.elements[5] * height) / 2;
    this.material.uniformsNeedUpdate = true;
    if (this.sorted) this.sort(eye);
  }

  /** Put instances in the order that blending needs; it is seen in the next frame. */
  private sort(eye: Vector3): void {
    const order = backToFront(this.places, [eye.x, eye.y, eye.z]);
    for (const [name, source] of [
      ['ff_place', this.places],
      ['ff_turn', this.turns],
    ] as const) {
      const attribute = this.geometry.getAttribute(name) as InstancedBufferAttribute;
      order.forEach((from, to) => {
        attribute.array.set(source.subarray(4 * from, 4 * from + 4), 4 * to);
      });
      attribute.needsUpdate = true;
    }
  }
}

function makeGeometry(
  places: Float32Array<ArrayBuffer>,
  turns: Float32Array<ArrayBuffer>,
): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
  geometry.setAttribute('position', new BufferAttribute(corners, 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  geometry.setAttribute('ff_place', new InstancedBufferAttribute(places.slice(), 4));
  geometry.setAttribute('ff_turn', new InstancedBufferAttribute(turns.slice(), 4));
  geometry.instanceCount = places.length / 4;
  geometry.boundingSphere = new Sphere(undefined, Infinity);
  return geometry;
}

function makeMaterial(
  file: ObjectFile,
  texture: DataArrayTexture,
  kind: 'opaque' | 'translucent' | 'glass',
  options: TrueImpostorOptions,
): RawShaderMaterial {
  const [x, y, z] = file.axes.map((axis) => [0, 1, 2].map((n) => (n === axis ? 1 : 0)));
  const low = new Vector3(...file.low);
  const high = new Vector3(...file.high);
  const defines: Record<string, string> = {
    TEXTURES: String(file.textures),
    MOST_STEPS: String(options.steps ?? 96),
    STEPS_PER_PIXEL: (options.stepsPerPixel ?? 0.75).toFixed(4),
  };
  if (options.fade !== undefined) defines.FADE = '';
  if (kind === 'glass') defines.GLASS = '';
  if (kind === 'translucent') defines.TRANSLUCENT = '';
  if (options.shadow === true) defines.SHADOW = '';
  if (options.reflect !== undefined) defines.REFLECT = options.reflect.toFixed(4);
  return new RawShaderMaterial({
    name: 'farfield true impostors',
    glslVersion: GLSL3,
    vertexShader: TRUE_VERTEX,
    fragmentShader: TRUE_FRAGMENT,
    defines,
    uniforms: {
      ...('ambient' in options.light ? lightUniforms(options.light as Light) : options.light),
      ff_fade: options.fade ?? { value: 0 },
      ff_eye: { value: new Vector3() },
      ff_focal: { value: 1 },
      ff_middle: { value: low.clone().add(high).multiplyScalar(0.5) },
      ff_half: { value: high.clone().sub(low).multiplyScalar(0.5) },
      ff_axes: { value: new Matrix3().set(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]) },
      ff_fields: { value: texture },
      ff_index: { value: options.index ?? 1.5 },
      ff_absorb: { value: new Vector3(...(options.absorb ?? [0.3, 0.3, 0.3])) },
    },
    side: DoubleSide,
    depthFunc: LessDepth,
    transparent: kind === 'translucent',
    depthWrite: kind !== 'translucent',
    premultipliedAlpha: kind === 'translucent',
    toneMapped: false,
  });
}
