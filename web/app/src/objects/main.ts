/** The example pages of object impostors: `?show=many`, and what else `SHOWS` names. */

import { showGlass } from './glass.js';
import { showMany } from './many.js';
import { showRing } from './ring.js';
import { Stand, type Show } from './stand.js';
import { showStones } from './stones.js';
import { showWalk } from './walk.js';

const SHOWS: Record<string, (stand: Stand, query: URLSearchParams) => Show | Promise<Show>> = {
  many: showMany,
  stones: showStones,
  ring: showRing,
  glass: showGlass,
  walk: showWalk,
};

declare global {
  interface Window {
    objects?: { stand: Stand; show: Show; hooks: Record<string, unknown>; stop: () => void };
  }
}

async function open(canvas: HTMLCanvasElement, line: HTMLElement): Promise<void> {
  const query = new URLSearchParams(location.search);
  const name = query.get('show') ?? 'many';
  const create = SHOWS[name] as (typeof SHOWS)[string] | undefined;
  if (create === undefined) {
    line.textContent = `There is no example “${name}”; there are ${Object.keys(SHOWS).join(', ')}.`;
    return;
  }
  const stand = new Stand(canvas);
  const show = await create(stand, query);
  stand.begin(show);
  line.textContent = show.title;
  const start = performance.now();
  let frames = 0;
  let running = requestAnimationFrame(function loop(now) {
    running = requestAnimationFrame(loop);
    const seconds = (now - start) / 1000;
    stand.drawOnPath(seconds);
    if (++frames % 60 === 0) {
      line.textContent = `${show.title} – ${(frames / seconds).toFixed(0)} frames a second`;
    }
  });
  const stop = (): void => cancelAnimationFrame(running);
  if (query.has('script')) stop();
  window.objects = { stand, show, hooks: show.hooks ?? {}, stop };
}

const canvas = document.getElementById('view');
const line = document.getElementById('line');
if (!(canvas instanceof HTMLCanvasElement) || line === null)
  throw new Error('The page is damaged.');
open(canvas, line).catch((error: unknown) => {
  line.textContent = error instanceof Error ? error.message : String(error);
});
