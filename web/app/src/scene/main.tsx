/** A scene: waiting for it, then its map with a corridor to draw on it. */

import { render } from 'preact';
import type { JSX } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import '../styles.css';
import '../pages.css';
import { address, get, post, tell, type Orientation, type Scene, type Suggestion } from '../api.js';
import { KeyForm, needsKey } from '../key.js';
import { count, metres } from '../words.js';
import { Designer } from './designer.js';
import { fromSuggestion, type Drawing } from './drawing.js';

const PATIENCE = 400;

function Page({ id }: { readonly id: string }): JSX.Element {
  const [scene, setScene] = useState<Scene | undefined>(undefined);
  const [suggestion, setSuggestion] = useState<Suggestion | undefined>(undefined);
  const [problem, setProblem] = useState<unknown>(undefined);

  useEffect(() => {
    const stop = new AbortController();
    let timer = 0;
    const look = async (): Promise<void> => {
      const found = await get<Scene>(`scenes/${id}`, stop.signal);
      setScene(found);
      document.title = `${found.name} – Farfield`;
      if (found.state === 'preparing') timer = window.setTimeout(watch, PATIENCE);
      if (found.state === 'ready') {
        setSuggestion(await get<Suggestion>(`scenes/${id}/suggestion`, stop.signal));
      }
    };
    const watch = (): void => {
      look().catch((error: unknown) => {
        if (!stop.signal.aborted) setProblem(error);
      });
    };
    watch();
    return () => {
      stop.abort();
      clearTimeout(timer);
    };
  }, [id]);

  if (needsKey(problem)) return <KeyForm />;
  if (problem !== undefined) return <Notice title="That did not work" text={tell(problem)} />;
  if (scene === undefined) return <Notice title="One moment …" text="" />;
  if (scene.state === 'refused') {
    return <Notice title={`${scene.name} cannot be used`} text={scene.reason ?? ''} />;
  }
  if (scene.bounds === null || suggestion === undefined) {
    return (
      <Notice
        title={scene.name}
        text="The model is being looked at: bounds, textures, a map."
        busy
      />
    );
  }
  const start: Drawing = fromSuggestion(suggestion);
  return (
    <Designer scene={scene} bounds={scene.bounds} start={start} cellSize={suggestion.cell_size}>
      <About scene={scene} />
    </Designer>
  );
}

function Notice(props: {
  readonly title: string;
  readonly text: string;
  readonly busy?: boolean;
}): JSX.Element {
  return (
    <main class="notice" aria-busy={props.busy === true}>
      {props.busy === true ? <div class="spinner" /> : null}
      <h1>{props.title}</h1>
      <p>{props.text}</p>
      <a href={address('')}>All walks and models</a>
    </main>
  );
}

/** What is known of the model, and how to read it otherwise. */
function About({ scene }: { readonly scene: Scene }): JSX.Element {
  const [problem, setProblem] = useState('');
  const { bounds, suspected, orientation } = scene;
  const turn = (wanted: Orientation): void => {
    post<{ id: string }>(`scenes/${scene.id}/orientation`, wanted).then(
      ({ id }) => location.assign(address(`scene/${id}`)),
      (error: unknown) => setProblem(tell(error)),
    );
  };
  const size = bounds?.max.map((high, axis) => metres(high - bounds.min[axis])) ?? [];
  return (
    <>
      {suspected === null ? null : (
        <p class="guess">
          This looks like a model{' '}
          {[
            suspected.up === 'z' ? 'with z pointing up' : '',
            suspected.scale === 1 ? '' : `in units of ${suspected.scale} m`,
          ]
            .filter((part) => part !== '')
            .join(', ')}
          .<button onClick={() => turn(suspected)}>Read it so</button>
        </p>
      )}
      <details>
        <summary>The model</summary>
        <dl>
          <div>
            <dt>Size</dt>
            <dd>{size.join(' × ')}</dd>
          </div>
          <div>
            <dt>Triangles</dt>
            <dd>{count(scene.triangles ?? 0)}</dd>
          </div>
          <div>
            <dt>Textures</dt>
            <dd>{count(scene.textures ?? 0)}</dd>
          </div>
        </dl>
        {scene.notes.map((note) => (
          <p key={note}>{note}</p>
        ))}
        <div class="row">
          <label>
            Up
            <select
              value={orientation.up}
              onChange={(event) =>
                turn({ ...orientation, up: event.currentTarget.value === 'z' ? 'z' : 'y' })
              }
            >
              <option value="y">y</option>
              <option value="z">z</option>
            </select>
          </label>
          <label>
            Unit
            <select
              value={String(orientation.scale)}
              onChange={(event) =>
                turn({ ...orientation, scale: Number(event.currentTarget.value) })
              }
            >
              {[...new Set([1, 0.01, 0.001, 0.3048, 0.0254, orientation.scale])].map((scale) => (
                <option key={scale} value={String(scale)}>
                  {UNITS.get(scale) ?? `${scale} m`}
                </option>
              ))}
            </select>
          </label>
        </div>
        {problem === '' ? null : <p role="alert">{problem}</p>}
      </details>
    </>
  );
}

const UNITS = new Map([
  [1, 'metre'],
  [0.01, 'centimetre'],
  [0.001, 'millimetre'],
  [0.3048, 'foot'],
  [0.0254, 'inch'],
]);

const id = location.pathname.replace(/\/$/, '').split('/').pop() ?? '';
const app = document.getElementById('app');
if (app !== null) render(<Page id={id} />, app);
