/** Many objects, still and moving, drawn as impostors or as they are. */

import { ObjectImpostors } from '@farfield/three';
import {
  Color,
  DirectionalLight,
  Fog,
  Group,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  PlaneGeometry,
  Vector3,
} from 'three';
import { createMill, type Mill } from './mill.js';
import type { Show, Stand } from './stand.js';

export function showMany(stand: Stand, query: URLSearchParams): Show {
  const count = Number(query.get('count') ?? 500);
  const moving = Number(query.get('moving') ?? 0.1);
  const { scene, renderer, camera } = stand;
  scene.background = new Color(0x9fc4e8);
  if (query.has('fog')) scene.fog = new Fog(0x9fc4e8, 20, 160);
  const sun = new DirectionalLight(0xffffff, 2.5);
  sun.position.set(3, 5, 4);
  scene.add(sun, new HemisphereLight(0xcfe4ff, 0x665544, 1));
  const ground = new Mesh(
    new PlaneGeometry(600, 600),
    new MeshStandardMaterial({ color: 0x668844, roughness: 1 }),
  );
  ground.rotation.x = -Math.PI / 2;
  scene.add(ground);
  const impostors = new ObjectImpostors({
    renderer,
    atlas: Number(query.get('atlas') ?? 2048),
    perFrame: Number(query.get('perFrame') ?? 8),
    milliseconds: Number(query.get('milliseconds') ?? 4),
    fade: Number(query.get('fade') ?? 0.25),
  });
  scene.add(impostors.group);
  const holder = new Group();
  scene.add(holder);
  const mills: Mill[] = [];
  for (let n = 0; n < count; n++) {
    const mill = createMill((n * 0.618) % 1, Number(query.get('detail') ?? 5));
    const radius = 14 + 110 * Math.sqrt(n / count);
    const angle = n * 2.39996;
    mill.object.position.set(radius * Math.cos(angle), 0, radius * Math.sin(angle));
    mill.object.rotation.y = n;
    holder.add(mill.object);
    mills.push(mill);
  }
  const turns = (n: number): boolean => n < moving * count;
  let on = false;
  const use = (wanted: boolean): void => {
    if (wanted === on) return;
    on = wanted;
    mills.forEach(({ object }, n) => {
      if (on) impostors.add(object, turns(n) ? { age: 0.1 } : {});
      else impostors.remove(object);
    });
    if (!on) impostors.update(camera);
  };
  use(!query.has('without'));
  return {
    title: `${count} windmills`,
    frame: (seconds) => {
      mills.forEach(({ mixer }, n) => {
        if (turns(n)) mixer.setTime(seconds + n);
      });
      if (on) impostors.update(camera, seconds);
    },
    path: (seconds) => {
      const angle = 0.12 * seconds;
      const eye = new Vector3(6 * Math.cos(angle), 2.5, 6 * Math.sin(angle));
      return {
        eye,
        at: new Vector3(eye.x - 10 * Math.sin(angle), 2.5, eye.z + 10 * Math.cos(angle)),
      };
    },
    hooks: { impostors, mills, use },
  };
}
