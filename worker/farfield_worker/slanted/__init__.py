"""Slanted quads: far geometry as textured quads on planes of affine disparity."""
