/** The front page: a place for a new model, the walks there are, and models to bake more of. */

import { render } from 'preact';
import type { JSX } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import '../styles.css';
import '../pages.css';
import { apiAddress, get, type Scene } from '../api.js';
import { KeyForm, needsKey } from '../key.js';
import { readBakes, type Bake } from './bakes.js';
import { Drop } from './drop.js';

function Front(): JSX.Element {
  const [bakes, setBakes] = useState<readonly Bake[] | undefined>(undefined);
  const [scenes, setScenes] = useState<readonly Scene[]>([]);
  const [next, setNext] = useState<string | null>(null);
  const [locked, setLocked] = useState(false);

  const more = (cursor: string): void => {
    const query = cursor === '' ? '' : `&cursor=${encodeURIComponent(cursor)}`;
    get<{ next?: string | null }>(`bakes?order=newest&limit=24${query}`).then(
      (answer) => {
        setBakes((before) => [...(before ?? []), ...readBakes(answer)]);
        setNext(answer.next ?? null);
      },
      (error: unknown) => {
        setLocked(needsKey(error));
        setBakes((before) => before ?? []);
      },
    );
  };
  useEffect(() => {
    more('');
    get<{ scenes: Scene[] }>('scenes?state=ready&limit=24').then(
      (answer) => setScenes(answer.scenes),
      () => undefined,
    );
  }, []);

  return (
    <main class="front">
      <h1>Farfield</h1>
      <p>
        Walk through models of any size in a plain browser. Everything far away is baked into
        pictures with depth, everything near stays geometry, and both stream in as you go.
      </p>
      {locked ? <KeyForm /> : <Drop />}
      {bakes === undefined || locked ? null : bakes.length === 0 ? (
        <p class="quiet">There is nothing to walk through yet.</p>
      ) : (
        <section>
          <h2>Walks</h2>
          <ul class="gallery">
            {bakes.map((bake) => (
              <li key={bake.id}>
                <a href={`walk/${encodeURIComponent(bake.id)}`}>
                  <Picture scene={bake.scene} />
                  <strong>{bake.name}</strong>
                  <span>{bake.progress}</span>
                </a>
                <a class="more" href={`bake/${encodeURIComponent(bake.id)}`}>
                  Progress and sharing
                </a>
              </li>
            ))}
          </ul>
          {next === null ? null : <button onClick={() => more(next)}>Show more</button>}
        </section>
      )}
      {scenes.length === 0 ? null : (
        <section>
          <h2>Models</h2>
          <ul class="gallery small">
            {scenes.map((scene) => (
              <li key={scene.id}>
                <a href={`scene/${encodeURIComponent(scene.id)}`}>
                  <Picture scene={scene.id} />
                  <strong>{scene.name}</strong>
                </a>
              </li>
            ))}
          </ul>
        </section>
      )}
    </main>
  );
}

function Picture({ scene }: { readonly scene: string }): JSX.Element {
  const [missing, setMissing] = useState(scene === '');
  return missing ? (
    <div class="picture" />
  ) : (
    <img
      class="picture"
      alt=""
      loading="lazy"
      src={apiAddress(`scenes/${encodeURIComponent(scene)}/thumbnail.png`)}
      onError={() => setMissing(true)}
    />
  );
}

const app = document.getElementById('app');
if (app !== null) render(<Front />, app);
