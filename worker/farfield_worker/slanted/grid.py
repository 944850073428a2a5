"""Fragments of a face by texel, and which of them a disparity plane may draw."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: texels a quad is grown by on each side, which closes hairlines between sheets (slanted/clip.py)
GROWTH = 0.05


class Grid(NamedTuple):
    """The fragments of a face, sorted by texel.

    Attributes:
        starts: (resolution^2 + 1,) int32, first fragment of each texel.
        disparity, low, high: (n,) float, true disparity and the interval allowed, 1/m.
        owner: (n,) int32, the sheet that has captured each, -1 if none yet; `low` of captured ones
            is infinite, so that nothing may draw them again.
        resolution: texels across the face.
    """

    starts: Ints
    disparity: Floats
    low: Floats
    high: Floats
    owner: Ints
    resolution: int


def texel_starts(texel: Ints, resolution: int) -> Ints:
    """First fragment of each texel, (resolution^2 + 1,) int32, for `texel` (n,) in order."""
    starts = np.zeros(resolution * resolution + 1, np.int32)
    _count(texel, starts)
    return starts


@njit(cache=True)
def _count(texel: Any, starts: Any) -> None:
    """Write to `starts` how many of `texel`, in order, come before each texel."""
    for t in texel:
        starts[t + 1] += 1
    for t in range(1, len(starts)):
        starts[t] += starts[t - 1]


@njit(cache=True)
def value(resolution: int, x: int, y: int, a: float, b: float, c: float) -> float:
    """Disparity of plane (a, b, c) at the centre of texel (x, y)."""
    size = 2.0 / resolution
    return a * ((x + 0.5) * size - 1.0) + b * ((y + 0.5) * size - 1.0) + c


@njit(cache=True)
def drawable(resolution: int, x: int, y: int, a: float, b: float, c: float) -> bool:
    """Whether plane (a, b, c) is nowhere negative in the grown square of texel (x, y)."""
    least = (abs(a) + abs(b)) * (1.0 + 2.0 * GROWTH) / resolution
    return value(resolution, x, y, a, b, c) >= least


@njit(cache=True, inline="always")
def match(grid: Any, x: int, y: int, a: float, b: float, c: float) -> int:
    """Fragment, not yet captured, at texel (x, y) that plane (a, b, c) may draw; -1 if none."""
    resolution = grid.resolution
    found = -1
    cell = y * resolution + x
    first, end = grid.starts[cell], grid.starts[cell + 1]
    if first < end:
        size = 2.0 / resolution
        d = a * ((x + 0.5) * size - 1.0) + b * ((y + 0.5) * size - 1.0) + c
        if d >= (abs(a) + abs(b)) * (1.0 + 2.0 * GROWTH) / resolution:
            for f in range(first, end):
                if grid.low[f] <= d <= grid.high[f]:
                    found = f
                    break
    return found


@njit(cache=True)
def count_texels(grid: Any, plane: Any, x0: int, y0: int, x1: int, y1: int) -> int:
    """Texels of a rectangle at which the plane may draw something; none lie outside the face."""
    total = 0
    resolution = grid.resolution
    for y in range(max(y0, 0), min(y1, resolution)):
        for x in range(max(x0, 0), min(x1, resolution)):
            if match(grid, x, y, plane[0], plane[1], plane[2]) >= 0:
                total += 1
    return total
