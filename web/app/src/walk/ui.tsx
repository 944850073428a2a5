/** The walk page's interface: readout, remarks, help, and the states before a walk begins. */

import { useEffect, useState } from 'preact/hooks';
import type { JSX } from 'preact';
import { Compare } from './compare.js';
import { Help } from './help.js';
import { saveFile } from './save.js';
import { Recorder } from './path.js';
import { Readout } from './readout.js';
import type { Session } from './session.js';
import { readState, type ViewState } from './state.js';
import { headsetOffered } from './xr.js';

/** How long a remark must last before it is shown, and then stays, milliseconds. */
const REMARK_DELAY = 350;
const REMARK_STAY = 1200;

export function Interface({ session }: { session: Session }): JSX.Element {
  const state = useViewState(session);
  const remark = useSteady(state.remark);
  const [panel, setPanel] = useState(() => window.matchMedia('(min-width: 700px)').matches);
  const [help, setHelp] = useState(false);
  const [compare, setCompare] = useState(false);
  const [headset, setHeadset] = useState(false);
  const { comparison } = session;
  const toggleCompare = (open: boolean): void => {
    setCompare(open);
    comparison.mode = open ? 'split' : 'walk';
    if (open && comparison.state !== 'ready' && comparison.state !== 'loading') {
      void comparison.load().then(() => {
        if (comparison.state === 'ready') comparison.mode = 'split';
      });
    }
  };
  useEffect(() => void headsetOffered().then(setHeadset), []);
  useEffect(() => {
    const pace = (steps: number): void => {
      session.walker.pace = Math.min(16, Math.max(0.125, session.walker.pace * 2 ** (steps / 4)));
    };
    session.controls.onKey = (code) => {
      if (code === 'Equal' || code === 'NumpadAdd') pace(1);
      if (code === 'Minus' || code === 'NumpadSubtract') pace(-1);
      if (code === 'KeyX') session.walk.frozen = !session.walk.frozen;
      if (code === 'KeyB' && comparison.offered) toggleCompare(comparison.mode === 'walk');
      if (code === 'KeyO') saveScreenshot(session);
      if (code === 'KeyK') toggleRecording(session);
      if (code === '?' || code === 'KeyH') setHelp((open) => !open);
      if (code === 'KeyP') setPanel((open) => !open);
      if (code === 'KeyG') session.walker.flying = !session.walker.flying;
      if (code === 'Escape') setHelp(false);
    };
    session.controls.onWheel = pace;
  }, [session]);
  return (
    <>
      <header class="bar">
        <h1 class="title">{state.name}</h1>
        <nav class="buttons">
          {state.phase === 'walking' && headset ? (
            <button
              type="button"
              onClick={() => void session.headset.enter().catch(() => undefined)}
            >
              VR
            </button>
          ) : null}
          {state.phase === 'walking' && comparison.offered ? (
            <button type="button" aria-pressed={compare} onClick={() => toggleCompare(!compare)}>
              Compare
            </button>
          ) : null}
          <button type="button" aria-pressed={panel} onClick={() => setPanel(!panel)}>
            Figures
          </button>
          <button type="button" aria-pressed={help} onClick={() => setHelp(!help)}>
            Help
          </button>
        </nav>
      </header>
      {panel && state.phase === 'walking' ? <Readout state={state} session={session} /> : null}
      {state.phase === 'walking' ? null : <Opening state={state} />}
      <Thumb session={session} />
      {compare && state.phase === 'walking' ? (
        <Compare session={session} close={() => toggleCompare(false)} />
      ) : null}
      {state.recording ? <p class="recording">Recording your path: K ends it</p> : null}
      {state.phase === 'walking' ? (
        <p class="remark" role="status" data-shown={remark !== undefined}>
          {remark ?? ''}
        </p>
      ) : null}
      {state.phase === 'walking' && !help ? <Hint /> : null}
      {help ? <Help close={() => setHelp(false)} flying={state.flying} /> : null}
    </>
  );
}

/** What is drawn now, without the interface, as a picture file. */
function saveScreenshot(session: Session): void {
  session.draw();
  session.renderer.domElement.toBlob((blob) => {
    if (blob !== null) saveFile(blob, `${session.walk.manifest?.walk.name ?? 'walk'}.png`);
  });
}

/** Begin to record a path, or end it and save it. */
function toggleRecording(session: Session): void {
  const { recorder } = session;
  session.recorder = recorder === undefined ? new Recorder() : undefined;
  if (recorder === undefined) return;
  const blob = new Blob([JSON.stringify(recorder.file)], { type: 'application/json' });
  saveFile(blob, 'path.json');
}

export function Problem({ title, text }: { title: string; text: string }): JSX.Element {
  return (
    <main class="center">
      <div class="card" role="alert">
        <h1>{title}</h1>
        <p>{text}</p>
        <p class="actions">
          <button type="button" onClick={() => location.reload()}>
            Try again
          </button>
        </p>
      </div>
    </main>
  );
}

function Opening({ state }: { state: ViewState }): JSX.Element {
  return (
    <div class="center quiet" role="status">
      <p class="waiting">
        <span class="spinner" aria-hidden="true" />
        {state.phase === 'opening' ? 'Opening the walk…' : (state.remark ?? 'Loading the view…')}
      </p>
    </div>
  );
}

function Hint(): JSX.Element | null {
  const [shown, setShown] = useState(true);
  useEffect(() => {
    const timer = setTimeout(() => setShown(false), 9000);
    return () => clearTimeout(timer);
  }, []);
  const touch = window.matchMedia('(pointer: coarse)').matches;
  return (
    <p class="hint" data-shown={shown} aria-hidden={!shown}>
      {touch ? (
        'Left thumb walks, right thumb looks'
      ) : (
        <>
          <kbd>W</kbd>
          <kbd>A</kbd>
          <kbd>S</kbd>
          <kbd>D</kbd> to walk, drag or click to look, <kbd>H</kbd> for more
        </>
      )}
    </p>
  );
}

function Thumb({ session }: { session: Session }): JSX.Element | null {
  const [, redraw] = useState(0);
  const { stick } = session.controls;
  useEffect(() => {
    let frame = 0;
    const loop = (): void => {
      if (session.controls.stick !== undefined || frame % 10 === 0) redraw((n) => n + 1);
      frame++;
      handle = requestAnimationFrame(loop);
    };
    let handle = requestAnimationFrame(loop);
    return () => cancelAnimationFrame(handle);
  }, [session]);
  if (stick === undefined) return null;
  return (
    <div class="stick" style={{ left: `${stick.x}px`, top: `${stick.y}px` }} aria-hidden="true">
      <div style={{ transform: `translate(${stick.dx}px, ${stick.dy}px)` }} />
    </div>
  );
}

function useViewState(session: Session): ViewState {
  const [state, setState] = useState(() => readState(session));
  useEffect(() => {
    const timer = setInterval(() => setState(readState(session)), 200);
    return () => clearInterval(timer);
  }, [session]);
  return state;
}

/** A value without its flickers: shown only if it lasts, and then for a while. */
function useSteady(value: string | undefined): string | undefined {
  const [steady, setSteady] = useState<string | undefined>(undefined);
  useEffect(() => {
    const timer = setTimeout(
      () => setSteady(value),
      value === undefined ? REMARK_STAY : REMARK_DELAY,
    );
    return () => clearTimeout(timer);
  }, [value]);
  return steady;
}
