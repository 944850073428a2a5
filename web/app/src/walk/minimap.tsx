/** The corridor from above: every cell around the walker and what has become of it. */

import { useEffect, useRef } from 'preact/hooks';
import type { JSX } from 'preact';
import type { Session } from './session.js';

const WIDTH = 200;
const HEIGHT = 130;
/** Cells across the map. */
const ACROSS = 11;
const COLOURS = {
  ready: '#5aa7f0',
  loading: '#f2c078',
  absent: '#6d5a43',
  failed: '#e0605a',
  none: '#3b4652',
} as const;

export function Minimap({ session }: { session: Session }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const timer = setInterval(() => {
      if (canvas.current !== null) drawMap(canvas.current, session);
    }, 100);
    return () => clearInterval(timer);
  }, [session]);
  return (
    <figure class="minimap">
      <canvas
        ref={canvas}
        style={{ width: `${WIDTH}px`, height: `${HEIGHT}px` }}
        role="img"
        aria-label="Map of the cells around you"
      />
      <figcaption>
        {(['ready', 'loading', 'absent', 'failed'] as const).map((state) => (
          <span key={state}>
            <i style={{ background: COLOURS[state] }} />
            {{ ready: 'ready', loading: 'loading', absent: 'not baked', failed: 'failed' }[state]}
          </span>
        ))}
      </figcaption>
    </figure>
  );
}

function drawMap(canvas: HTMLCanvasElement, { walk, walker }: Session): void {
  const { index } = walk;
  const context = canvas.getContext('2d');
  if (index === undefined || context === null) return;
  const ratio = Math.min(2, window.devicePixelRatio);
  canvas.width = WIDTH * ratio;
  canvas.height = HEIGHT * ratio;
  const { size } = index.grid;
  const scale = (WIDTH * ratio) / (ACROSS * Math.max(size[0], size[2]));
  const [x, , z] = walker.eye;
  const place = (px: number, pz: number): [number, number] => [
    canvas.width / 2 + (px - x) * scale,
    canvas.height / 2 + (pz - z) * scale,
  ];
  const cells = index.near(walker.eye, 0.6 * ACROSS * Math.max(...size));
  for (const cell of cells) {
    const [left, top] = place(cell.low[0], cell.low[2]);
    const [width, height] = [size[0] * scale - ratio, size[2] * scale - ratio];
    context.fillStyle = COLOURS[walk.cellState(cell.name) ?? 'none'];
    context.fillRect(left, top, width, height);
    if (cell.name === walk.cell?.name) {
      context.strokeStyle = '#fff';
      context.lineWidth = 2 * ratio;
      context.strokeRect(left, top, width, height);
    }
  }
  context.translate(canvas.width / 2, canvas.height / 2);
  context.rotate(-walker.yaw);
  context.fillStyle = '#fff';
  context.strokeStyle = '#0b1016';
  context.lineWidth = ratio;
  context.beginPath();
  context.moveTo(0, -8 * ratio);
  context.lineTo(5 * ratio, 6 * ratio);
  context.lineTo(0, 3 * ratio);
  context.lineTo(-5 * ratio, 6 * ratio);
  context.closePath();
  context.fill();
  context.stroke();
}
