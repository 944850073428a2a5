/** The front page: what Farfield is, and the walks there are. */

import { render } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import type { JSX } from 'preact';
import '../styles.css';
import { readBakes, type Bake } from './bakes.js';

function Front(): JSX.Element {
  const [bakes, setBakes] = useState<readonly Bake[] | undefined>(undefined);
  useEffect(() => {
    void fetch(new URL('api/v1/bakes', document.baseURI))
      .then(async (response) => (response.ok ? readBakes(await response.json()) : []))
      .catch(() => [])
      .then(setBakes);
  }, []);
  return (
    <main class="front">
      <h1>Farfield</h1>
      <p>
        Walk through models of any size in a plain browser. Everything far away is baked into
        pictures with depth, everything near stays geometry, and both stream in as you go.
      </p>
      {bakes === undefined ? null : bakes.length === 0 ? (
        <p>
          There is nothing to walk through yet. Bake a model with{' '}
          <code>farfield demo model.glb</code>.
        </p>
      ) : (
        <ul class="walks">
          {bakes.map((bake) => (
            <li key={bake.id}>
              <a href={`walk/${encodeURIComponent(bake.id)}`}>
                {bake.name} <span>{bake.progress}</span>
              </a>
            </li>
          ))}
        </ul>
      )}
    </main>
  );
}

const app = document.getElementById('app');
if (app !== null) render(<Front />, app);
