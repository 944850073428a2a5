/** `window.farfield`: what tests and scripts drive a walk with. */

import type { Session } from './session.js';
import { STILL, type Intent } from './walker.js';

export interface Pixels {
  readonly width: number;
  readonly height: number;
  /** RGBA, top row first; with `?capture` alpha is 0 where the background shows. */
  readonly data: Uint8Array;
}

export interface FrameReport {
  /** The shown cell. */
  readonly cell: string | undefined;
  /** The cell the eye is in. */
  readonly wanted: string | undefined;
  /** Pixels that show background; meaningful with `?capture`. */
  readonly background: number;
  readonly eye: readonly number[];
}

export interface Hooks {
  /** Settles when the first cell is complete and drawn. */
  readonly ready: Promise<void>;
  /** Graphics driver, as far as the browser tells. */
  readonly renderer: string;
  readonly stats: Session['walk']['stats'];
  /** Stand somewhere, exactly; settles when the cell there is complete and drawn. */
  goTo: (x: number, y: number, z: number, yaw: number, pitch: number) => Promise<void>;
  /** Settles when the cell at the eye is complete and drawn. */
  settled: () => Promise<void>;
  /** Draw a frame and read it back. */
  pixels: () => Pixels;
  /** Draw one frame at a place, without waiting for anything, and say what it shows. */
  frame: (x: number, y: number, z: number, yaw: number, pitch: number) => FrameReport;
  /** Walk by an intent for some seconds and draw one frame. */
  walk: (seconds: number, intent: Partial<Intent>) => FrameReport;
  /** Wait for the browser's next frame. */
  nextFrame: () => Promise<void>;
  /** What has become of a cell, by name. */
  cellState: (name: string) => string | undefined;
  readonly session: Session;
}

export function createHooks(session: Session): Hooks {
  const { walk, renderer } = session;
  const gl = renderer.getContext() as WebGL2RenderingContext;
  const info = gl.getExtension('WEBGL_debug_renderer_info');

  const nextFrame = (): Promise<void> =>
    new Promise((resolve) => requestAnimationFrame(() => resolve()));
  const settled = async (): Promise<void> => {
    await walk.loaded;
    for (;;) {
      session.draw();
      if (walk.settled) return;
      await nextFrame();
    }
  };
  const pixels = (): Pixels => {
    session.draw();
    const { width, height } = renderer.domElement;
    const bottomUp = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bottomUp);
    const data = new Uint8Array(bottomUp.length);
    for (let row = 0; row < height; row++) {
      const from = 4 * width * (height - 1 - row);
      data.set(bottomUp.subarray(from, from + 4 * width), 4 * width * row);
    }
    return { width, height, data };
  };
  const report = (): FrameReport => {
    const { data } = pixels();
    let background = 0;
    for (let n = 3; n < data.length; n += 4) if (data[n] === 0) background++;
    return {
      cell: walk.cell?.name,
      wanted: walk.wanted?.cell.name,
      background,
      eye: session.walker.eye,
    };
  };
  return {
    ready: settled(),
    renderer: String(gl.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER)),
    get stats() {
      return walk.stats;
    },
    goTo: (x, y, z, yaw, pitch) => {
      session.place({ eye: [x, y, z], yaw, pitch });
      return settled();
    },
    settled,
    pixels,
    frame: (x, y, z, yaw, pitch) => {
      session.place({ eye: [x, y, z], yaw, pitch });
      return report();
    },
    walk: (seconds, intent) => {
      session.step(seconds, { ...STILL, ...intent });
      return report();
    },
    nextFrame,
    cellState: (name) => walk.cellState(name),
    session,
  };
}
