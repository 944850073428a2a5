/** One refracting object among stones of the same shape that throw shadows on themselves and mirror. */

import { TrueImpostors, loadObject, type TrueImpostorOptions } from '@farfield/three';
import { Vector3 } from 'three';
import { LIGHT } from './light.js';
import { SkyDome } from './sky-dome.js';
import type { Show, Stand } from './stand.js';
import { ASTEROID } from './stones.js';

export async function showGlass(stand: Stand, query: URLSearchParams): Promise<Show> {
  const baked = await loadObject(query.get('object') ?? ASTEROID);
  const kinds: Omit<TrueImpostorOptions, 'light'>[] = [
    { kind: 'opaque', shadow: true },
    { kind: 'glass', index: 1.45, absorb: [0.5, 0.12, 0.2] },
    { kind: 'opaque', shadow: true, reflect: 0.5 },
    { kind: 'translucent', absorb: [0.6, 0.6, 0.6] },
  ];
  stand.scene.add(new SkyDome(LIGHT));
  kinds.forEach((options, n) => {
    const places = new Float32Array([3 * (n - 1.5), 0, 0, 1]);
    const stone = new TrueImpostors(baked, places, new Float32Array([0, 0, 0, 1]), {
      light: LIGHT,
      steps: 128,
      ...options,
    });
    stand.scene.add(stone);
  });
  return {
    title: 'Opaque with its own shadow, glass, mirroring, translucent',
    frame: () => undefined,
    path: (seconds) => {
      const angle = 0.4 * Math.sin(0.3 * seconds);
      const eye = new Vector3(10 * Math.sin(angle), 2, 10 * Math.cos(angle));
      return { eye, at: new Vector3() };
    },
  };
}
