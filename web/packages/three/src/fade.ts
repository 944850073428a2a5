/**
 * A short cross-fade between two cells. Blending would show the background through both, so each
 * pixel belongs to one cell alone, by interleaved gradient noise (Jimenez, "Next generation
 * post-processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014).
 */

import type { BufferGeometry, IUniform, Mesh, RawShaderMaterial } from 'three';
import type { CellView } from './cell-view.js';

/** `ff_fade` is 0 for all pixels, s for a share s of them, -s for those that s leaves. */
export const FADE_GLSL = `
uniform float ff_fade;
bool ff_faded() {
  if (ff_fade == 0.0) return false;
  float noise = fract(52.9829189 * fract(dot(floor(gl_FragCoord.xy), vec2(0.06711056, 0.00583715))));
  return ff_fade > 0.0 ? noise >= ff_fade : noise < -ff_fade;
}
`;

/** Have a mesh drawn with its cell's fade, though its material is shared with other cells. */
export function fadeWith(
  view: CellView,
  { material }: Mesh<BufferGeometry, RawShaderMaterial>,
  fade: IUniform<number>,
): void {
  if (fade.value === view.fade) return;
  fade.value = view.fade;
  material.uniformsNeedUpdate = true;
}

/** The cell that goes and the one that comes. */
export class Fade {
  private going: CellView | undefined;
  private coming: CellView | undefined;
  private readonly seconds: number;
  private began = 0;

  /** @param seconds how long it takes; 0 changes at once */
  constructor(seconds: number) {
    this.seconds = seconds;
  }

  /** Show a view instead of another. */
  change(from: CellView | undefined, to: CellView, now: number): void {
    this.end();
    if (from === undefined) return;
    this.going = from;
    this.coming = to;
    this.began = now;
    if (this.seconds === 0) this.end();
  }

  /** Go on; `visible` is whether cells are drawn at all. */
  update(now: number, visible: boolean): void {
    const { going, coming } = this;
    if (going === undefined || coming === undefined) return;
    const share = (now - this.began) / this.seconds;
    // A view that was let go of meanwhile is no longer there to fade.
    if (!(share < 1) || going.group.parent === null) {
      this.end();
      return;
    }
    coming.fade = Math.max(share, 1e-3);
    going.fade = -coming.fade;
    going.group.visible = visible;
  }

  /** Show only the one that comes. */
  end(): void {
    const { going, coming } = this;
    if (going !== undefined) {
      going.fade = 0;
      going.group.visible = false;
    }
    if (coming !== undefined) coming.fade = 0;
    this.going = this.coming = undefined;
  }
}
