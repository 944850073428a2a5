import {
  InlineBuilder,
  PAGES,
  Solid,
  UploadScheduler,
  buildSolid,
  type NearState,
} from '@farfield/core';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Matrix4,
  Mesh,
  PerspectiveCamera,
  Texture,
  Vector4,
} from 'three';
import { describe, expect, test } from 'vitest';
// @ts-expect-error the generator is plain JavaScript
import { generate, target } from '../../../scripts/generate-shading.js';
import { readFileSync } from 'node:fs';
import { AttributeUpload } from '../src/attribute-upload.js';
import { CellView } from '../src/cell-view.js';
import { createFarMaterial, quadOf } from '../src/far-material.js';
import { lightGlsl, lightUniforms } from '../src/light.js';
import { MotionTracker } from '../src/motion.js';
import { NearMaterials } from '../src/near-materials.js';
import { LIGHT_GLSL } from '../src/shading.generated.js';
import { setInfiniteFar } from '../src/index.js';

const EMPTY = new Solid(buildSolid([], [1, 2, 3], [8, 8, 8]));
const LIGHT = {
  ambient: [0.1, 0.1, 0.1],
  sun_direction: [0, 1, 0],
  sun: [1, 1, 1],
  hemisphere_up: [0, 0, 0],
  hemisphere_down: [0, 0, 0],
  sky_zenith: [0, 0, 1],
  sky_horizon: [1, 1, 1],
  sky_ground: [0, 1, 0],
} as const;

const STATE: NearState = {
  map: undefined,
  emissiveMap: undefined,
  emissive: [0, 0, 0],
  alpha: 'opaque',
  cutoff: 0.5,
  doubleSided: false,
  unlit: false,
};

describe('the light model', () => {
  test('the generated module is current', () => {
    const text = (generate as () => string)();
    expect(readFileSync(target as URL, 'utf8')).toBe(text);
  });

  test('every uniform of the GLSL has a value, and no value is without a uniform', () => {
    const declared = [...LIGHT_GLSL.matchAll(/uniform vec3 (\w+);/g)].map(([, name]) => name);
    expect(Object.keys(lightUniforms(LIGHT)).sort()).toEqual(declared.sort());
    const glsl = lightGlsl(LIGHT);
    expect(glsl).not.toContain('uniform');
    expect(glsl).toContain('const vec3 ff_ambient = vec3(1e-1, 1e-1, 1e-1);');
    for (const name of declared) expect(glsl).toContain(`const vec3 ${name} =`);
  });
});

describe('setInfiniteFar', () => {
  test('keeps x, y and w, and what is far beyond the old far plane in view', () => {
    const camera = new PerspectiveCamera(60, 1.5, 0.1, 100);
    const point = new Vector4(3, 2, -1e6, 1);
    const before = point.clone().applyMatrix4(camera.projectionMatrix);
    setInfiniteFar(camera);
    const after = point.clone().applyMatrix4(camera.projectionMatrix);
    expect([after.x, after.y, after.w]).toEqual([before.x, before.y, before.w]);
    expect(before.z / before.w).toBeGreaterThan(1);
    expect(after.z / after.w).toBeLessThan(1);
    const infinite = new Vector4(0, 0, -1, 0).applyMatrix4(camera.projectionMatrix);
    expect(infinite.z).toBeLessThan(infinite.w);
    const onNear = new Vector4(0, 0, -0.1, 1).applyMatrix4(camera.projectionMatrix);
    expect(onNear.z / onNear.w).toBeCloseTo(-1, 5);
    const identity = camera.projectionMatrix.clone().multiply(camera.projectionMatrixInverse);
    identity.elements.forEach((value, n) =>
      expect(value).toBeCloseTo(new Matrix4().elements[n], 6),
    );
  });
});

describe('MotionTracker', () => {
  test('measures in the coordinates of the group, however it is placed', () => {
    const group = new Group();
    group.position.set(5, 0, 0);
    group.rotation.y = Math.PI / 2;
    group.updateMatrixWorld();
    const camera = new PerspectiveCamera();
    const tracker = new MotionTracker();
    let motion = tracker.update(camera, group, 0);
    for (let n = 0; n <= 200; n++) {
      camera.position.set(5 + n * 0.02, 1, 0);
      camera.updateMatrixWorld();
      motion = tracker.update(camera, group, 10 * n);
    }
    // The group is turned left by a quarter: the world's +x is its +z.
    motion.eye.forEach((value, axis) => expect(value).toBeCloseTo([0, 1, 4][axis], 6));
    motion.velocity.forEach((value, axis) => expect(value).toBeCloseTo([0, 0, 2][axis], 1));
    motion.view.forEach((value, axis) => expect(value).toBeCloseTo([1, 0, 0][axis], 6));
  });
});

describe('NearMaterials', () => {
  test('states share materials, and programs differ only where they must', () => {
    const materials = new NearMaterials(LIGHT, 20, false);
    const plain = materials.get(STATE);
    expect(materials.get({ ...STATE })).toBe(plain);
    expect(plain.defines).toEqual({ NEAR_FIELD: '2.125e+1' });
    const map = { uri: 'a', wrapS: 'repeat', wrapT: 'repeat', filter: 'linear' } as const;
    const [first, second] = [new Texture(), new Texture()];
    const textured = materials.get({ ...STATE, map, alpha: 'mask' }, first);
    expect(textured.defines).toEqual({ ...plain.defines, MAP: '', MASK: '' });
    expect(materials.get({ ...STATE, map, alpha: 'mask' }, second)).toBe(textured);
    expect(textured.uniforms.ff_map.value).toBe(second);
    expect(textured.uniforms.ff_fade).toBe(plain.uniforms.ff_fade);
    const shiny = { ...STATE, emissive: [0, 0.5, 0], unlit: true, doubleSided: true } as const;
    expect(materials.get(shiny).defines).toEqual({
      ...plain.defines,
      ...{ EMISSIVE: '', UNLIT: '', BOTH_SIDES: '' },
    });
    materials.dispose();
    expect(new NearMaterials(LIGHT, Infinity, true).get(STATE).defines).toEqual({ FADE: '' });
  });
});

describe('CellView', () => {
  test('names slots instead of pages, counts its bytes, and lets go once', async () => {
    const cell = {
      format: 'farfield-cell',
      version: 1,
      cell: [0, 0, 0],
      eyes: [
        [1, 2, 3],
        [2, 2, 3],
      ],
      quads: {
        eyes: [0, 1],
        faces: [0, 1],
        layers: [0, 0],
        corner_counts: [3, 3],
        corners: [0, 0, 8, 0, 8, 8, 0, 0, 8, 0, 8, 8],
        planes: [0, 0, 0.1, 0, 0, 0.1],
        pages: [1, 0],
        scales: [1, 1],
        offsets: [0, 0, 0, 0],
        turned: [0, 0],
      },
      atlases: ['a.png', 'b.png'],
      near: [],
      figures: {},
    };
    const bytes = new TextEncoder().encode(JSON.stringify(cell)).buffer;
    const built = await new InlineBuilder().cell(bytes, 64);
    let released = 0;
    const material = createFarMaterial({} as never, { value: 0 }, false);
    const view = new CellView(built, [7, 3], material, [], [], EMPTY, () => released++);
    const slots = [...(view.far?.geometry.attributes.texel.array ?? [])].filter(
      (_, n) => n % 3 === 2,
    );
    const codes = slots.map((slot) => (slot < 0 ? -1 - slot : slot));
    expect(slots.map((slot) => slot < 0)).toEqual([false, false, false, true, true, true]);
    expect(codes.map((code) => code % PAGES)).toEqual([3, 3, 3, 7, 7, 7]);
    expect(slots.map(quadOf)).toEqual([0, 0, 0, 1, 1, 1]);
    expect(view.group.position.toArray()).toEqual([1, 2, 3]);
    // Six vertices of 4 + 3 floats, six indices.
    expect(view.bytes).toBe(6 * 7 * 4 + 6 * 4);
    expect(view.drawCalls).toBe(1);
    view.dispose();
    expect(released).toBe(1);
  });
});

describe('AttributeUpload', () => {
  test('every buffer is carried in a drawn frame before the promise settles', async () => {
    const uploads = new UploadScheduler();
    const upload = new AttributeUpload(uploads);
    const geometries = [1, 2, 3].map((n) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(30 * n), 3));
      geometry.setIndex(new BufferAttribute(new Uint32Array(9), 1));
      return geometry;
    });
    const user = { priority: () => 0 };
    const adding = upload.add(geometries, user, new AbortController().signal);
    const carried = new Set<unknown>();
    for (let frame = 0; frame < 20; frame++) {
      uploads.frame(200);
      upload.update();
      for (const child of upload.group.children) {
        if (!(child instanceof Mesh) || !child.visible) continue;
        const { attributes, index } = child.geometry as BufferGeometry;
        Object.values(attributes).forEach((attribute) => carried.add(attribute));
        if (index !== null) carried.add(index);
        child.onAfterRender(
          {} as never,
          {} as never,
          {} as never,
          {} as never,
          {} as never,
          {} as never,
        );
      }
      await Promise.resolve();
      await new Promise((resolve) => setImmediate(resolve));
    }
    await adding;
    for (const { attributes, index } of geometries) {
      expect(carried.has(attributes.position)).toBe(true);
      expect(carried.has(index)).toBe(true);
    }
    upload.dispose();
  });

  test('a frame that is not drawn settles nothing', async () => {
    const uploads = new UploadScheduler();
    const upload = new AttributeUpload(uploads);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(9), 3));
    let done = false;
    void upload
      .add([geometry], { priority: () => 0 }, new AbortController().signal)
      .then(() => (done = true));
    for (let frame = 0; frame < 5; frame++) {
      uploads.frame(1000);
      upload.update();
      await new Promise((resolve) => setImmediate(resolve));
    }
    expect(done).toBe(false);
  });
});
