/** The walk page. */

import { FarfieldError, asError } from '@farfield/core';
import { render } from 'preact';
import '../styles.css';
import {
  fadeSeconds,
  isCapture,
  manifestUrl,
  nearImpostors,
  pathUrl,
  textureMemory,
} from './address.js';
import { createHooks, type Hooks } from './capture.js';
import { parsePath, type PathFile } from './path.js';
import { Session } from './session.js';
import { explain } from './state.js';
import { Interface, Problem } from './ui.js';

declare global {
  interface Window {
    farfield?: Hooks;
  }
}

const ui = document.getElementById('ui');
const canvas = document.getElementById('view');
if (ui === null || !(canvas instanceof HTMLCanvasElement)) throw new Error('The page is damaged.');

const fail = (title: string, text: string): void => {
  document.body.dataset.failed = '';
  render(<Problem title={title} text={text} />, ui);
};

function textureMegabytes(): number {
  // Phones report at most 8 GB here, and small ones crash long before their memory is full.
  const memory = 'deviceMemory' in navigator ? Number(navigator.deviceMemory) : 8;
  const coarse = window.matchMedia('(pointer: coarse)').matches;
  return memory <= 4 || coarse ? 128 : 256;
}

async function playable(url: string): Promise<PathFile> {
  const response = await fetch(url);
  if (!response.ok) throw new FarfieldError('format', `There is no path to play at ${url}.`);
  return parsePath(await response.text());
}

function open(ui: HTMLElement, canvas: HTMLCanvasElement): void {
  const page = new URL(location.href);
  const url = manifestUrl(page);
  if (url === undefined) {
    fail('Which walk?', 'The address names no walk; it should end in /walk/ and the walk’s id.');
    return;
  }
  if (document.createElement('canvas').getContext('webgl2') === null) {
    fail(
      'This browser can’t show the walk',
      'A walk needs WebGL 2. Use a current browser, and check that hardware acceleration is on.',
    );
    return;
  }
  const capture = isCapture(page);
  const session = new Session({
    canvas,
    manifestUrl: url,
    capture,
    fade: fadeSeconds(page),
    near: nearImpostors(page),
    textureBytes: (textureMemory(page) ?? textureMegabytes()) * 2 ** 20,
  });
  window.farfield = createHooks(session);
  window.farfield.ready.catch(() => undefined);
  session.walk.addEventListener('load', ({ manifest }) => {
    document.title = `${manifest.walk.name} – Farfield`;
  });
  session.walk.addEventListener('error', ({ error }) => {
    const { title, text } = explain(error);
    fail(title, text);
  });
  session.walk.addEventListener('context-lost', () => {
    document.body.dataset.lost = '';
  });
  session.walk.addEventListener('context-restored', () => {
    delete document.body.dataset.lost;
  });
  const path = pathUrl(page);
  if (path !== undefined) {
    // A walk that can't be opened says so itself.
    window.farfield.ready.then(
      () =>
        playable(path).then(
          (file) => session.play(file),
          (error: unknown) => {
            const { title, text } = explain(asError(error));
            fail(title, text);
          },
        ),
      () => undefined,
    );
  }
  if (!capture) render(<Interface session={session} />, ui);
}

open(ui, canvas);
