/**
 * Copies images into textures a strip at a time. `copyTextureToTexture` takes a bitmap that was
 * never uploaded itself straight from memory; a whole page at once would stall a frame.
 */

import { strips, type UploadStep } from '@farfield/core';
import { Box2, Texture, Vector2, Vector3, type WebGLRenderer } from 'three';

/** Bytes of the largest strip. */
export const STRIP_BYTES = 512 * 1024;

/**
 * Steps that copy `bitmap` into `target` at layer `slot`; `last` runs before the last strip.
 * The bitmap is closed at the end.
 */
export function* uploadBitmap(
  renderer: WebGLRenderer,
  bitmap: ImageBitmap,
  target: Texture,
  slot: number,
  last: () => void = () => undefined,
): Generator<UploadStep> {
  const source = new Texture(bitmap);
  const { width, height } = bitmap;
  try {
    for (const [top, bottom] of strips(height, 4 * width, STRIP_BYTES)) {
      yield {
        bytes: 4 * width * (bottom - top),
        run: () => {
          if (bottom === height) last();
          const region = new Box2(new Vector2(0, top), new Vector2(width, bottom));
          renderer.copyTextureToTexture(source, target, region, new Vector3(0, top, slot));
        },
      };
    }
  } finally {
    source.dispose();
    bitmap.close();
  }
}

/** Decode an image off the main thread, its bytes untouched by alpha or colour management. */
export function decodeImage(bytes: ArrayBuffer): Promise<ImageBitmap> {
  return createImageBitmap(new Blob([bytes]), {
    premultiplyAlpha: 'none',
    colorSpaceConversion: 'none',
  });
}
