"""The land around the lake: shore, hills, two volcanoes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: half extent of the scene, metres
EXTENT = 675.0
#: mean distance of the shore from the middle of the lake
SHORE = 575.0
#: x, z, height, reach of single mountains
PEAKS = (
    (455.0, -640.0, 150.0, 250.0),
    (660.0, -500.0, 185.0, 230.0),
    (-610.0, -610.0, 120.0, 260.0),
    (-660.0, 120.0, 70.0, 200.0),
    (640.0, 560.0, 105.0, 250.0),
    (-560.0, 650.0, 95.0, 240.0),
    (120.0, -690.0, 62.0, 210.0),
    (690.0, 60.0, 58.0, 190.0),
    (-180.0, 700.0, 52.0, 180.0),
)


def _wave(x: Floats) -> Floats:
    x = x - np.floor(x)
    return np.where(x < 0.5, 16.0 * x * (0.5 - x), 16.0 * (x - 0.5) * (x - 1.0))


def _ripples(x: Floats, z: Floats) -> Floats:
    """Sum of waves of falling length, about [-1, 1]."""
    total = np.zeros_like(x)
    for k, (a, b, c) in enumerate(
        ((3.1, 1.7, 0.1), (-2.3, 3.9, 0.4), (7.9, 4.1, 0.7), (-5.3, 9.7, 0.2), (17.3, -11.9, 0.9))
    ):
        warp = 0.15 * _wave((b * x - a * z) / 900.0)
        total = total + _wave((a * x + b * z) / 1000.0 + c + warp) / (1.6 ** (k + 1))
    return total


def land_height(x: Floats, z: Floats) -> Floats:
    """Height of the land, metres; below zero under the lake.  x, z: (n,) float."""
    square = np.maximum(np.abs(x), np.abs(z))
    radius = np.sqrt(x * x + z * z)
    # between a circle and a square, so that the corners hold more than water
    reach = 0.55 * radius + 0.45 * square
    out = reach - SHORE * 0.97 - 14.0 * _wave((x - 1.7 * z) / 340.0) - 9.0 * _wave((z + x) / 210.0)
    rise = np.maximum(out, 0.0)
    ripples = _ripples(x, z)
    hills = rise * 0.08 + rise * rise * 0.0011 * (1.0 + 0.55 * ripples) + 0.6 * ripples * (rise > 0)
    fade = np.minimum(rise / 45.0, 1.0)
    for px, pz, height, width in PEAKS:
        d = np.sqrt((x - px) * (x - px) + (z - pz) * (z - pz)) / width
        cone = np.maximum(1.0 - d, 0.0)
        # a volcano's flank grows steeper towards its top
        lift = height * cone * cone * (1.0 + 0.6 * cone) / 1.6
        hills = hills + lift * fade * (1.0 + 0.12 * ripples)
    return np.where(out > 0, 0.35 * np.minimum(rise, 2.0) + hills, np.maximum(out * 0.12, -1.6))
