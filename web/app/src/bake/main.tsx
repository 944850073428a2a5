/** A bake: its cells filling in over the map, what can be done with it, and the link to share. */

import { render } from 'preact';
import type { JSX } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import '../styles.css';
import '../pages.css';
import { address, apiAddress, get, post, tell, type Bake, type Scene } from '../api.js';
import { KeyForm, needsKey } from '../key.js';
import { SceneMap } from '../map/map.js';
import type { MapWindow } from '../map/view.js';
import { count, duration } from '../words.js';
import { squaresOf, type Grid, type Squares } from './cells.js';

const ENDED = ['cancelled', 'done', 'failed'];

function Page({ id }: { readonly id: string }): JSX.Element {
  const [bake, setBake] = useState<Bake | undefined>(undefined);
  const [scene, setScene] = useState<Scene | undefined>(undefined);
  const [squares, setSquares] = useState<Squares | undefined>(undefined);
  const [problem, setProblem] = useState<unknown>(undefined);
  const [watching, setWatching] = useState(0);
  const done = useRef(new Set<string>());
  const [, setCount] = useState(0);

  useEffect(() => {
    const load = async (): Promise<void> => {
      const found = await get<Bake>(`bakes/${id}`);
      setBake(found);
      document.title = `${found.name} – Farfield`;
      const walk = await get<{ grid: Grid }>(`walks/${id}/walk.json`);
      setSquares(await squaresOf(walk.grid, (href) => get(`walks/${id}/${href}`)));
      // whoever only has the link may not see the model
      setScene(await get<Scene>(`scenes/${found.scene}`).catch(() => undefined));
    };
    load().catch(setProblem);
  }, [id]);

  useEffect(() => {
    const events = new EventSource(apiAddress(`bakes/${id}/events`));
    events.addEventListener('cells', (event: MessageEvent<string>) => {
      for (const name of JSON.parse(event.data) as string[]) done.current.add(name);
      setCount(done.current.size);
    });
    events.addEventListener('state', (event: MessageEvent<string>) =>
      setBake(JSON.parse(event.data) as Bake),
    );
    events.addEventListener('end', () => events.close());
    return () => events.close();
  }, [id, watching]);

  if (needsKey(problem)) return <KeyForm />;
  if (problem !== undefined && bake === undefined) {
    return (
      <main class="notice">
        <h1>That did not work</h1>
        <p>{tell(problem)}</p>
        <a href={address('')}>All walks and models</a>
      </main>
    );
  }
  if (bake === undefined || squares === undefined) return <main class="notice">One moment …</main>;

  const act = (verb: string): void => {
    setProblem(undefined);
    post<Bake>(`bakes/${id}/${verb}`).then((now) => {
      setBake(now);
      // a stream that has ended is opened again
      setWatching((times) => times + 1);
    }, setProblem);
  };
  const failed = new Map(bake.failures.map(({ cell, reason }) => [cell, reason]));
  const room = 4 * Math.max(...squares.size);
  const { min, max } = squares.area;
  const around = {
    min: [min[0] - room, min[1] - room] as const,
    max: [max[0] + room, max[1] + room] as const,
  };
  const map = scene?.map ?? null;
  return (
    <main class="split">
      <SceneMap
        label={`${count(done.current.size)} of ${count(squares.all.length)} cells are baked`}
        picture={map === null ? undefined : apiAddress(`scenes/${bake.scene}/map.png`)}
        area={map ?? around}
        focus={around}
        draw={(context, window) => paint(context, window, squares, done.current, failed)}
      />
      <aside class="side">
        <a class="home" href={address('')}>
          Farfield
        </a>
        <h1>{bake.name}</h1>
        <Progress bake={bake} />
        <div class="row">
          {bake.cells.done > 0 ? (
            <a class="button main" href={address(`walk/${id}`)}>
              {bake.cells.done < bake.cells.total ? 'Walk while it bakes' : 'Walk'}
            </a>
          ) : (
            <span class="button main waiting-link">Walk</span>
          )}
          <Share id={id} />
        </div>
        <div class="tools" role="group" aria-label="Bake">
          {bake.state === 'running' || bake.state === 'queued' ? (
            <button onClick={() => act('pause')}>Pause</button>
          ) : null}
          {bake.state === 'paused' || bake.state === 'cancelled' ? (
            <button onClick={() => act('resume')}>Resume</button>
          ) : null}
          {ENDED.includes(bake.state) ? null : (
            <button onClick={() => act('cancel')}>Cancel</button>
          )}
          {bake.cells.failed > 0 || bake.state === 'failed' ? (
            <button onClick={() => act('retry')}>Try failed cells again</button>
          ) : null}
        </div>
        {problem === undefined ? null : <p role="alert">{tell(problem)}</p>}
        {bake.reason === null ? null : <p role="alert">{bake.reason}</p>}
        {bake.failures.length === 0 ? null : (
          <section class="failures">
            <h2>Cells that failed</h2>
            <ul>
              {bake.failures.slice(0, 200).map(({ cell, reason }) => (
                <li key={cell}>
                  <strong>{cell.replaceAll('_', ' · ')}</strong> {reason}
                </li>
              ))}
            </ul>
          </section>
        )}
        <p>
          <a href={address(`scene/${bake.scene}`)}>Draw another walk through this model</a>
        </p>
      </aside>
    </main>
  );
}

const STATES = {
  queued: 'Waiting for others',
  running: 'Baking',
  paused: 'Paused',
  cancelled: 'Cancelled',
  done: 'Done',
  failed: 'Failed',
};

function Progress({ bake }: { readonly bake: Bake }): JSX.Element {
  const { total, done, failed } = bake.cells;
  const parts = [`${count(done)} of ${count(total)} cells`];
  if (failed > 0) parts.push(`${count(failed)} failed`);
  if (bake.rate !== null) {
    parts.push(
      bake.rate >= 1
        ? `${bake.rate.toFixed(1)} cells a second`
        : `${(1 / bake.rate).toFixed(1)} s a cell`,
    );
  }
  if (bake.seconds_left !== null && done < total) parts.push(`${duration(bake.seconds_left)} left`);
  return (
    <div class="progress" aria-live="polite">
      <strong>{STATES[bake.state]}</strong>
      <progress aria-label="Cells baked" max={total} value={done} />
      <span>{parts.join(', ')}</span>
    </div>
  );
}

function Share({ id }: { readonly id: string }): JSX.Element {
  const [copied, setCopied] = useState(false);
  const link = address(`walk/${id}`);
  const copy = (): void => {
    navigator.clipboard.writeText(link).then(
      () => setCopied(true),
      () => window.prompt('The link to share', link),
    );
  };
  return (
    <button onClick={copy} title={link}>
      {copied ? 'Link copied' : 'Copy link'}
    </button>
  );
}

function paint(
  context: CanvasRenderingContext2D,
  window: MapWindow,
  squares: Squares,
  done: ReadonlySet<string>,
  failed: ReadonlyMap<string, string>,
): void {
  const [width, depth] = squares.size.map((length) => length * window.scale);
  const gap = Math.min(1, width / 8);
  for (const { name, x, z } of squares.all) {
    const { left, top } = window.pixel({ x, z });
    if (left > window.width || top > window.height || left + width < 0 || top + depth < 0) continue;
    context.fillStyle = failed.has(name)
      ? 'rgb(240 96 84 / 75%)'
      : done.has(name)
        ? 'rgb(126 211 150 / 62%)'
        : 'rgb(255 255 255 / 22%)';
    context.fillRect(left, top, Math.max(1, width - gap), Math.max(1, depth - gap));
  }
}

const id = location.pathname.replace(/\/$/, '').split('/').pop() ?? '';
const app = document.getElementById('app');
if (app !== null) render(<Page id={id} />, app);
