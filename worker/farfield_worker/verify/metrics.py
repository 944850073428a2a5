"""Figures that compare two pictures of the same view, a full render and a walk.

Shares are of the *far pixels*: those where either picture shows far field. Neighbourhoods are 3x3,
cut off at the picture's edge. FLIP is that of Andersson et al., "FLIP: A Difference Evaluator for
Alternating Images" (2020), through its authors' package.
"""

from __future__ import annotations

from typing import NamedTuple

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

Rgb = NDArray[np.uint8]
Mask = NDArray[np.bool_]

#: channels further apart than this, of 255, do not match
MATCH = 8


class Shot(NamedTuple):
    """A picture and what is known of its pixels.

    Attributes:
        rgb: (h, w, 3) uint8, sRGB, over the sky.
        geometry: (h, w) bool, true where anything was drawn.
        far: (h, w) bool, true where what was drawn is far field.
    """

    rgb: Rgb
    geometry: Mask
    far: Mask


class Figures(NamedTuple):
    """Figures of one view, defined in `compare`, and the number of far pixels they are of."""

    wrong: float
    missing: float
    extra: float
    flip: float
    psnr: float
    pixels: int


def _shifted(a: NDArray[np.generic], dy: int, dx: int) -> tuple[slice, slice, slice, slice]:
    """Slices (rows here, columns here, rows there, columns there) of a and its neighbour."""
    h, w = a.shape[:2]
    return (
        slice(max(0, -dy), h - max(0, dy)),
        slice(max(0, -dx), w - max(0, dx)),
        slice(max(0, dy), h - max(0, -dy)),
        slice(max(0, dx), w - max(0, -dx)),
    )


def unmatched(a: Rgb, b: Rgb) -> Mask:
    """Pixels of `a` that match no pixel in `b`'s 3x3 neighbourhood: (h, w) bool."""
    found = np.zeros(a.shape[:2], bool)
    wide_a, wide_b = a.astype(np.int16), b.astype(np.int16)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            y, x, v, u = _shifted(a, dy, dx)
            found[y, x] |= (np.abs(wide_a[y, x] - wide_b[v, u]) <= MATCH).all(axis=2)
    return ~found


def eroded(mask: Mask) -> Mask:
    """Pixels whose whole 3x3 neighbourhood is in `mask`: (h, w) bool."""
    out = mask.copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            y, x, v, u = _shifted(mask, dy, dx)
            out[y, x] &= mask[v, u]
    return out


def flip_map(reference: Rgb, test: Rgb) -> NDArray[np.float32]:
    """FLIP error of each pixel at the default viewing distance: (h, w) float32 in [0, 1]."""
    error, _, _ = flip_evaluator.evaluate(
        reference.astype(np.float32) / 255,
        test.astype(np.float32) / 255,
        "LDR",
        applyMagma=False,
        computeMeanError=False,
    )
    return np.asarray(error, np.float32).reshape(reference.shape[:2])


#: pixels beyond which no pixel's error depends on another: FLIP's widest filter has a radius of 10
REACH = 16


def mean_flip(reference: Rgb, test: Rgb, mask: Mask) -> float:
    """Mean FLIP error over the pixels in `mask`, of which there must be one.

    FLIP is slow: only the rectangle that can matter to those pixels is compared.
    """
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    y = slice(max(0, int(rows[0]) - REACH), int(rows[-1]) + REACH + 1)
    x = slice(max(0, int(columns[0]) - REACH), int(columns[-1]) + REACH + 1)
    return float(flip_map(reference[y, x], test[y, x])[mask[y, x]].mean())


def compare(full: Shot, walk: Shot) -> Figures | None:
    """Figures of `walk` against `full`; None where neither shows any far field.

    wrong: pixels that match none of the other picture's neighbourhood, the larger of both ways.
    missing: background where the full render has geometry all around; extra: the other way round.
    flip: mean error. psnr: decibels.
    """
    far = full.far | walk.far
    pixels = int(far.sum())
    if pixels == 0:
        return None
    wrong = max(
        int((far & unmatched(full.rgb, walk.rgb)).sum()),
        int((far & unmatched(walk.rgb, full.rgb)).sum()),
    )
    missing = int((far & ~walk.geometry & eroded(full.geometry)).sum())
    extra = int((far & ~full.geometry & eroded(walk.geometry)).sum())
    flip = mean_flip(full.rgb, walk.rgb, far)
    error = full.rgb[far].astype(np.float64) - walk.rgb[far]
    mean_square = float((error * error).mean())
    psnr = 10 * np.log10(255**2 / mean_square) if mean_square > 0 else np.inf
    return Figures(wrong / pixels, missing / pixels, extra / pixels, flip, float(psnr), pixels)


def combine(figures: list[Figures]) -> Figures | None:
    """Figures over the far pixels of several views taken together; None without any."""
    pixels = sum(f.pixels for f in figures)
    if pixels == 0:
        return None
    weights = np.array([f.pixels for f in figures]) / pixels

    def mean(name: str) -> float:
        return float(weights @ np.array([getattr(f, name) for f in figures]))

    mean_square = float(weights @ np.array([10 ** (-f.psnr / 10) for f in figures]))
    psnr = -10 * np.log10(mean_square) if mean_square > 0 else np.inf
    return Figures(mean("wrong"), mean("missing"), mean("extra"), mean("flip"), float(psnr), pixels)
