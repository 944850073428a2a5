/** The panel of figures. */

import { useState } from 'preact/hooks';
import type { JSX } from 'preact';
import { Minimap } from './minimap.js';
import type { Session } from './session.js';
import type { ViewState } from './state.js';

const COUNT = new Intl.NumberFormat('en', { maximumFractionDigits: 0 });
const MEGABYTE = 2 ** 20;

export function Readout({ state, session }: { state: ViewState; session: Session }): JSX.Element {
  const { stats } = state;
  const memory = (bytes: number): string => COUNT.format(bytes / MEGABYTE);
  const rows: [string, string][] = [
    ['Cell', (stats.cell ?? '–').replaceAll('_', ' · ')],
    ['Quads', COUNT.format(stats.quads)],
    ['Near triangles', COUNT.format(stats.nearTriangles)],
    ['Whole model', COUNT.format(session.walk.manifest?.walk.scene.triangles ?? 0)],
    ['Draw calls', COUNT.format(stats.drawCalls.total)],
    ['Textures', `${memory(stats.textureBytes)} of ${memory(stats.textureCap)} MB`],
    ['Geometry', `${memory(stats.geometryBytes)} MB`],
    ['Downloaded', `${(stats.downloads.bytes / MEGABYTE).toFixed(1)} MB`],
    ['Cells ready', COUNT.format(stats.cells.ready)],
    ['Pace', `${state.flying ? 'flying, ' : ''}${state.speed.toFixed(1)} m/s`],
  ];
  if (stats.downloads.pending > 0) rows.push(['Loading', COUNT.format(stats.downloads.pending)]);
  return (
    <aside class="panel" aria-label="Figures">
      <p class="fps">
        <strong>{Math.round(state.fps)}</strong> <span>frames a second</span>
      </p>
      <FrameGraph times={state.frameTimes} />
      <dl>
        {rows.map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
      <Minimap session={session} />
      <Overlaid session={session} />
    </aside>
  );
}

/** What may be drawn over the walk. */
function Overlaid({ session }: { session: Session }): JSX.Element {
  const [, redraw] = useState(0);
  const { overlays, walk } = session;
  const layered = (walk.manifest?.walk.layers.length ?? 0) > 0;
  const choices: [string, boolean, (on: boolean) => void][] = [
    [layered ? 'Layers' : 'Quads', overlays.tint, (on) => (overlays.tint = on)],
    ['Outlines', overlays.outlines, (on) => (overlays.outlines = on)],
    ['Border', overlays.border, (on) => (overlays.border = on)],
    ['Freeze', walk.frozen, (on) => (walk.frozen = on)],
  ];
  return (
    <fieldset class="choices">
      <legend class="hidden">Show</legend>
      {choices.map(([name, on, set]) => (
        <label key={name}>
          <input
            type="checkbox"
            checked={on}
            onChange={(event) => {
              set(event.currentTarget.checked);
              event.currentTarget.blur();
              redraw((n) => n + 1);
            }}
          />
          {name}
        </label>
      ))}
    </fieldset>
  );
}

/** Frame times as a line; the rule is at 60 frames a second. */
function FrameGraph({ times }: { times: readonly number[] }): JSX.Element {
  const [width, height, most] = [120, 28, 50];
  const y = (time: number): number => height - (Math.min(time, most) / most) * height;
  const points = times.map((time, n) => `${(n / 119) * width},${y(time).toFixed(1)}`).join(' ');
  return (
    <svg
      class="graph"
      viewBox={`0 0 ${width} ${height}`}
      preserveAspectRatio="none"
      aria-hidden="true"
    >
      <line x1="0" x2={width} y1={y(1000 / 60)} y2={y(1000 / 60)} />
      <polyline points={points} />
    </svg>
  );
}
