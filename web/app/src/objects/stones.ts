/** Stones as true impostors or as instances of the mesh, seen alone or by the thousand. */

import { TrueImpostors, loadObject } from '@farfield/three';
import {
  Color,
  InstancedMesh,
  Matrix4,
  Mesh,
  Quaternion,
  Vector3,
  type BufferGeometry,
  ShaderMaterial,
  type Object3D,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { LIGHT } from './light.js';
import { randomPlaces } from './places.js';
import type { Show, Stand } from './stand.js';

export const ASTEROID = new URL('objects/asteroid/object.json', new URL('..', location.href)).href;

/** The light model of walks for instances of a mesh with vertex colours. */
function meshMaterial(): ShaderMaterial {
  return new ShaderMaterial({
    name: 'stone',
    vertexColors: true,
    toneMapped: false,
    uniforms: {
      ambient: { value: new Color(...LIGHT.ambient) },
      sun: { value: new Color(...LIGHT.sun) },
      towards: { value: new Vector3(...LIGHT.sun_direction) },
      above: { value: new Color(...LIGHT.hemisphere_up) },
      below: { value: new Color(...LIGHT.hemisphere_down) },
    },
    vertexShader: `
      varying vec3 v_normal;
      varying vec3 v_color;
      void main() {
        v_normal = mat3(modelMatrix) * mat3(instanceMatrix) * normal;
        v_color = color.rgb;
        gl_Position = projectionMatrix * viewMatrix * modelMatrix * instanceMatrix
          * vec4(position, 1.0);
      }`,
    fragmentShader: `
      uniform vec3 ambient, sun, towards, above, below;
      varying vec3 v_normal;
      varying vec3 v_color;
      void main() {
        vec3 n = normalize(v_normal);
        vec3 light = ambient + sun * max(dot(n, towards), 0.0) + mix(below, above, 0.5 + 0.5 * n.y);
        gl_FragColor = vec4(clamp(v_color * light, 0.0, 1.0), 1.0);
        #include <colorspace_fragment>
      }`,
  });
}

export async function showStones(stand: Stand, query: URLSearchParams): Promise<Show> {
  const { scene } = stand;
  const count = Number(query.get('count') ?? 10000);
  const baked = await loadObject(new URL(query.get('object') ?? ASTEROID, location.href).href);
  const { places, turns } = randomPlaces(count, Number(query.get('radius') ?? 60));
  if (count === 1) {
    places.set([0, 0, 0, 1]);
    turns.set([0, 0, 0, 1]);
  }
  const impostors = new TrueImpostors(baked, places, turns, {
    light: LIGHT,
    shadow: query.has('shadow'),
    ...(query.has('kind') && { kind: query.get('kind') as 'glass' | 'translucent' }),
    ...(query.has('reflect') && { reflect: Number(query.get('reflect')) }),
  });
  scene.add(impostors);
  let mesh: Object3D | undefined;
  const model = query.get('model');
  if (model !== null) {
    const gltf = await new GLTFLoader().loadAsync(model);
    let geometry: BufferGeometry | undefined;
    gltf.scene.traverse((object) => {
      if (object instanceof Mesh) geometry = (object as Mesh).geometry;
    });
    if (geometry === undefined) throw new Error('The model has no mesh.');
    const instances = new InstancedMesh(geometry, meshMaterial(), count);
    const at = new Vector3();
    const turn = new Quaternion();
    for (let n = 0; n < count; n++) {
      at.fromArray(places, 4 * n);
      turn.fromArray(turns, 4 * n);
      const scale = new Vector3().setScalar(places[4 * n + 3]);
      instances.setMatrixAt(n, new Matrix4().compose(at, turn, scale));
    }
    instances.frustumCulled = false;
    mesh = instances;
    scene.add(mesh);
  }
  scene.background = new Color(query.has('sky') ? 0x9fc4e8 : 0);
  const use = (kind: string): void => {
    impostors.visible = kind === 'impostor';
    if (mesh !== undefined) mesh.visible = kind === 'mesh';
  };
  use('impostor');
  const radius = Number(query.get('from') ?? (count === 1 ? 4 : 75));
  return {
    title: `${count} stones of ${baked.file.triangles} triangles, each two triangles and a ray`,
    frame: () => undefined,
    path: (seconds) => ({
      eye: new Vector3(radius * Math.cos(0.1 * seconds), 6, radius * Math.sin(0.1 * seconds)),
      at: new Vector3(),
    }),
    hooks: { use, impostors, file: baked.file },
  };
}
