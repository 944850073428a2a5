/**
 * How large an impostor's picture is (Christiansen, section 4.7): as many texels as the object has
 * pixels, screen size x object size / distance, rounded up to the size of a slot. A texel must be no
 * bigger than a pixel (section 3), so what needs more than the largest slot is drawn as it is.
 */

/** Edges of slots, texels. */
export const SLOT_SIZES: readonly number[] = [32, 64, 128, 256];

/** A new picture gets this much more than it needs, so that a small step nearer keeps it sharp. */
export const HEADROOM = 1.15;

/** Texels around the object that stay empty, so that filtering finds no neighbour. */
export const MARGIN = 1;

/** Pixels that something of `size` metres covers at `distance`, `focal` pixels per unit of slope. */
export function pixelsAcross(size: number, distance: number, focal: number): number {
  return (focal * size) / distance;
}

/** The smallest slot whose texels are no bigger than a pixel; undefined if none is large enough. */
export function slotSize(
  pixels: number,
  headroom = HEADROOM,
  sizes: readonly number[] = SLOT_SIZES,
): number | undefined {
  return sizes.find((size) => size - 2 * MARGIN >= headroom * pixels);
}
