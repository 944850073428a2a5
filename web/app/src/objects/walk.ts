/** A walk with animated objects placed in it. */

import { Walk, type NearImpostors } from '@farfield/three';
import { AnimationMixer, DirectionalLight, HemisphereLight, type Object3D } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { createMill } from './mill.js';
import type { Show, Stand } from './stand.js';

const WAYS: readonly NearImpostors[] = ['auto', 'always', 'copies', 'never'];

export async function showWalk(stand: Stand, query: URLSearchParams): Promise<Show> {
  const near = WAYS.find((way) => way === query.get('near')) ?? 'never';
  const walk = new Walk(query.get('walk') ?? '', {
    renderer: stand.renderer,
    nearImpostors: near,
  });
  stand.scene.add(walk.group, new HemisphereLight(0xffffff, 0x888888, 2));
  const sun = new DirectionalLight(0xffffff, 2);
  sun.position.set(2, 5, 3);
  stand.scene.add(sun);
  walk.setCamera(stand.camera);
  const manifest = await walk.loaded;
  stand.look(manifest.walk.start.eye, [0, 0, 0]);
  const mixers: AnimationMixer[] = [];
  return {
    title: manifest.walk.name,
    frame: (seconds) => {
      for (const mixer of mixers) mixer.setTime(seconds);
      walk.update(seconds);
    },
    hooks: {
      walk,
      /** Place a windmill, or a glTF model with its first animation playing. */
      place: async (at: readonly number[], size: number, model?: string, age = 0.1) => {
        let object: Object3D;
        if (model === undefined) {
          const mill = createMill();
          ({ object } = mill);
          mixers.push(mill.mixer);
        } else {
          const gltf = await new GLTFLoader().loadAsync(model);
          object = gltf.scene;
          const mixer = new AnimationMixer(object);
          for (const clip of gltf.animations.slice(0, 1)) mixer.clipAction(clip).play();
          mixers.push(mixer);
        }
        object.position.set(at[0], at[1], at[2]);
        object.scale.setScalar(size);
        walk.add(object, { age });
        return object;
      },
    },
  };
}
