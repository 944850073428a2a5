/** The map with a corridor on it, its settings, and what they would come to. */

import type { ComponentChildren, JSX } from 'preact';
import { useMemo, useRef, useState } from 'preact/hooks';
import { address, apiAddress, post, tell, type Bounds, type Scene } from '../api.js';
import { SceneMap, type Pen } from '../map/map.js';
import type { Area, MapWindow } from '../map/view.js';
import { bytes, count, duration, metres } from '../words.js';
import {
  areaOf,
  boxOf,
  corridorOf,
  floorNear,
  movedPoint,
  pointAt,
  withPoint,
  type Drawing,
  type Kind,
} from './drawing.js';
import { usePlan } from './plan.js';

export interface DesignerProps {
  readonly scene: Scene;
  readonly bounds: Bounds;
  readonly start: Drawing;
  readonly cellSize: number;
  readonly children: ComponentChildren;
}

export function Designer(props: DesignerProps): JSX.Element {
  const { scene, bounds, start } = props;
  const [drawing, setDrawing] = useState<Drawing>(start);
  const [cellSize, setCellSize] = useState(Number(props.cellSize.toPrecision(3)));
  const [resolution, setResolution] = useState(512);
  const [problem, setProblem] = useState('');
  const [asking, setAsking] = useState(false);
  const held = useRef(-1);

  const all = useMemo<Area>(
    () => scene.map ?? { min: [bounds.min[0], bounds.min[2]], max: [bounds.max[0], bounds.max[2]] },
    [scene, bounds],
  );
  const corridor = corridorOf(drawing);
  const wanted = corridor && {
    scene: scene.id,
    corridor,
    settings: { cell_size: cellSize, resolution },
  };
  const plan = usePlan(cellSize > 0 ? wanted : undefined);

  const pen: Pen = {
    down: (spot, reach) => {
      const point = pointAt(drawing, spot, reach);
      held.current = point;
      if (point >= 0) return true;
      const floor = floorNear(
        drawing.points.length > 0 ? drawing.points : start.points,
        spot,
        bounds.min[1],
      );
      if (drawing.kind === 'box') {
        const corner = [spot.x, floor, spot.z] as const;
        setDrawing({ ...drawing, points: [corner, corner] });
        held.current = 1;
      } else {
        setDrawing(withPoint(drawing, spot, floor));
        held.current = drawing.points.length;
      }
      return true;
    },
    move: (spot) => setDrawing((before) => movedPoint(before, held.current, spot)),
    up: () => {
      held.current = -1;
    },
  };
  const [tool, setTool] = useState<Kind | 'move'>('move');
  const choose = (next: Kind | 'move'): void => {
    setTool(next);
    if (next !== 'move' && next !== drawing.kind)
      setDrawing({ ...drawing, kind: next, points: [] });
  };
  const bake = (): void => {
    if (wanted === undefined) return;
    setAsking(true);
    setProblem('');
    post<{ id: string }>('bakes', wanted).then(
      ({ id }) => location.assign(address(`bake/${id}`)),
      (error: unknown) => {
        setProblem(tell(error));
        setAsking(false);
      },
    );
  };
  const number = (label: string, value: number, set: (value: number) => void): JSX.Element => (
    <label>
      {label}
      <span class="unit">
        <input
          type="number"
          min="0"
          step="any"
          inputMode="decimal"
          value={Number(value.toPrecision(4))}
          onInput={(event) => {
            const typed = event.currentTarget.valueAsNumber;
            if (typed > 0) set(typed);
          }}
        />{' '}
        m
      </span>
    </label>
  );

  return (
    <main class="split">
      <SceneMap
        label={`Map of ${scene.name}, seen from above`}
        picture={scene.map === null ? undefined : apiAddress(`scenes/${scene.id}/map.png`)}
        area={all}
        focus={areaOf(drawing, all, 4 * cellSize)}
        draw={(context, window) => paint(context, window, drawing)}
        {...(tool === 'move' ? {} : { pen })}
      />
      <aside class="side">
        <a class="home" href={address('')}>
          Farfield
        </a>
        <h1>{scene.name}</h1>
        <p>Draw where people will walk. A walk is suggested; bake it as it is, or draw your own.</p>
        <div class="tools" role="group" aria-label="Drawing">
          {(['move', 'path', 'box'] as const).map((name) => (
            <button key={name} aria-pressed={tool === name} onClick={() => choose(name)}>
              {{ move: 'Move map', path: 'Draw path', box: 'Draw box' }[name]}
            </button>
          ))}
          <button
            disabled={drawing.points.length === 0}
            onClick={() =>
              setDrawing({
                ...drawing,
                points: drawing.kind === 'box' ? [] : drawing.points.slice(0, -1),
              })
            }
          >
            Undo
          </button>
          <button onClick={() => setDrawing(start)}>Suggest</button>
        </div>
        <div class="row">
          {number('Eye height', drawing.eye, (eye) => setDrawing({ ...drawing, eye }))}
          {drawing.kind === 'path'
            ? number('Width', drawing.width, (width) => setDrawing({ ...drawing, width }))
            : number('Height', drawing.height, (height) => setDrawing({ ...drawing, height }))}
          {number('Cell size', cellSize, setCellSize)}
          <label>
            Detail
            <select
              value={resolution}
              onChange={(event) => setResolution(Number(event.currentTarget.value))}
            >
              <option value={256}>small (256)</option>
              <option value={512}>usual (512)</option>
              <option value={1024}>fine (1024)</option>
            </select>
          </label>
        </div>
        <dl class="plan" aria-label="Plan" aria-live="polite">
          <div>
            <dt>Cells</dt>
            <dd>{plan.plan === undefined ? '–' : count(plan.plan.cells)}</dd>
          </div>
          <div>
            <dt>Polygons up to</dt>
            <dd>{plan.plan === undefined ? '–' : metres(plan.plan.near_field)}</dd>
          </div>
          <div>
            <dt>Size</dt>
            <dd>{plan.plan === undefined ? '–' : `about ${bytes(plan.plan.megabytes * 1e6)}`}</dd>
          </div>
          <div>
            <dt>Time on one core</dt>
            <dd>{plan.plan === undefined ? '–' : `about ${duration(plan.plan.seconds)}`}</dd>
          </div>
        </dl>
        {plan.problem === '' ? null : <p role="alert">{plan.problem}</p>}
        {problem === '' ? null : <p role="alert">{problem}</p>}
        <button class="main" disabled={plan.plan === undefined || asking} onClick={bake}>
          Bake this walk
        </button>
        {props.children}
      </aside>
    </main>
  );
}

const LINE = '#ffd27a';
const FILL = 'rgb(255 210 122 / 28%)';

function paint(context: CanvasRenderingContext2D, window: MapWindow, drawing: Drawing): void {
  const pixels = drawing.points.map(([x, , z]) => window.pixel({ x, z }));
  context.strokeStyle = FILL;
  context.fillStyle = FILL;
  context.lineCap = context.lineJoin = 'round';
  const box = drawing.kind === 'box' ? boxOf(drawing) : undefined;
  if (box !== undefined) {
    const low = window.pixel({ x: box.min[0], z: box.min[1] });
    const high = window.pixel({ x: box.max[0], z: box.max[1] });
    const area = [low.left, low.top, high.left - low.left, high.top - low.top] as const;
    context.fillRect(...area);
    context.strokeStyle = LINE;
    context.lineWidth = 2;
    context.strokeRect(...area);
  } else if (drawing.kind === 'path' && pixels.length > 0) {
    const trace = (width: number, style: string): void => {
      context.beginPath();
      pixels.forEach(({ left, top }) => context.lineTo(left, top));
      // a single point is a dot
      context.lineTo(pixels[pixels.length - 1].left + 0.01, pixels[pixels.length - 1].top);
      context.lineWidth = width;
      context.strokeStyle = style;
      context.stroke();
    };
    trace(Math.max(4, drawing.width * window.scale), FILL);
    trace(2, LINE);
  }
  context.fillStyle = LINE;
  context.strokeStyle = '#0b0f14';
  context.lineWidth = 1.5;
  for (const { left, top } of pixels) {
    context.beginPath();
    context.arc(left, top, 6, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
}
