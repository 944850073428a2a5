/** The texture that holds all pictures, and the slots it is divided into. */

import { SLOT_SIZES, SlotAtlas, type Slot } from '@farfield/core';
import {
  ClampToEdgeWrapping,
  LinearFilter,
  SRGBColorSpace,
  UnsignedByteType,
  WebGLRenderTarget,
} from 'three';

export class AtlasTarget {
  readonly target: WebGLRenderTarget;
  slots: SlotAtlas;

  /** `size`: edge of the texture, texels, a power of two of at least 256. */
  constructor(size: number) {
    this.target = new WebGLRenderTarget(size, size, {
      type: UnsignedByteType,
      colorSpace: SRGBColorSpace,
      // Pictures hold what the screen would: encoded colours, filtered as they are.
      internalFormat: 'RGBA8',
      minFilter: LinearFilter,
      magFilter: LinearFilter,
      wrapS: ClampToEdgeWrapping,
      wrapT: ClampToEdgeWrapping,
      generateMipmaps: false,
      stencilBuffer: false,
    });
    // So materials draw into it as onto the screen, colour space and tone mapping included: three.js
    // then needs no second program for each, and the picture is exactly what it stands for.
    Object.assign(this.target, { isXRRenderTarget: true });
    this.target.texture.name = 'farfield impostors';
    this.target.scissorTest = true;
    this.slots = new SlotAtlas(size, SLOT_SIZES[0]);
  }

  /** Where the next picture goes. */
  aim({ x, y, size }: Slot): void {
    this.target.viewport.set(x, y, size, size);
    this.target.scissor.set(x, y, size, size);
  }

  /** The context was lost, and all pictures with it. */
  forget(): void {
    this.slots = new SlotAtlas(this.slots.size, SLOT_SIZES[0]);
  }

  dispose(): void {
    this.target.dispose();
  }
}
