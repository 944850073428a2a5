/** A planet with a ring of a quarter of a million asteroids, as in GPU Gems 3, chapter 21. */

import { TrueImpostors, loadObject } from '@farfield/three';
import {
  Color,
  DirectionalLight,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  SphereGeometry,
  Vector3,
} from 'three';
import { LIGHT } from './light.js';
import { ringPlaces } from './places.js';
import type { Show, Stand } from './stand.js';
import { ASTEROID } from './stones.js';

const INNER = 140;
const OUTER = 260;

export async function showRing(stand: Stand, query: URLSearchParams): Promise<Show> {
  const { scene } = stand;
  const count = Number(query.get('count') ?? 250000);
  const baked = await loadObject(query.get('object') ?? ASTEROID);
  const { places, turns } = ringPlaces(count, INNER, OUTER);
  scene.background = new Color(0x04060c);
  const planet = new Mesh(
    new SphereGeometry(100, 96, 64),
    new MeshStandardMaterial({ color: 0xc79a62, roughness: 1, metalness: 0 }),
  );
  const sun = new DirectionalLight(0xffffff, 3);
  sun.position.set(...LIGHT.sun_direction);
  scene.add(planet, sun, new HemisphereLight(0x334466, 0x221100, 0.4));
  scene.add(new TrueImpostors(baked, places, turns, { light: LIGHT, shadow: query.has('shadow') }));
  return {
    title: `${count} asteroids of ${baked.file.triangles} triangles`,
    frame: () => undefined,
    path: (seconds) => {
      const angle = 0.03 * seconds;
      const eye = new Vector3(275 * Math.cos(angle), 14, 275 * Math.sin(angle));
      return { eye, at: new Vector3(60 * Math.cos(angle + 1.2), -6, 60 * Math.sin(angle + 1.2)) };
    },
  };
}
