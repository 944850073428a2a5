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
    (430.0, -700.0, 105.0, 330.0),
    (690.0, -470.0, 150.0, 330.0),
    (-640.0, -640.0, 80.0, 340.0),
    (-690.0, 150.0, 42.0, 260.0),
    (680.0, 600.0, 70.0, 320.0),
    (-600.0, 690.0, 60.0, 320.0),
    (90.0, -720.0, 40.0, 280.0),
    (720.0, 60.0, 36.0, 260.0),
    (-180.0, 720.0, 34.0, 260.0),
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
    hills = rise * 0.07 + rise * rise * 0.0006 * (1.0 + 0.6 * ripples) + 0.6 * ripples * (rise > 0)
    fade = np.minimum(rise / 45.0, 1.0)
    for px, pz, height, width in PEAKS:
        d = np.sqrt((x - px) * (x - px) + (z - pz) * (z - pz)) / width
        cone = np.maximum(1.0 - d, 0.0)
        # a volcano's flank grows steeper towards its top
        lift = height * cone * cone * (1.0 + 0.6 * cone) / 1.6
        hills = hills + lift * fade * (1.0 + 0.2 * ripples)
    return np.where(out > 0, 0.35 * np.minimum(rise, 2.0) + hills, np.maximum(out * 0.12, -1.6))


def land_tint(p: Floats, up: Floats) -> Floats:
    """Linear colour of the land at points p, (n, 3) float; `up`: y of the normals, (n,) float."""
    x, y, z = p[:, 0], p[:, 1], p[:, 2]
    ripples = _ripples(2.1 * z, 2.3 * x)
    wood = np.clip(0.5 + 0.9 * ripples, 0, 1)[:, None]
    color = np.array((0.40, 0.45, 0.17)) * (1 - wood) + np.array((0.17, 0.26, 0.09)) * wood
    dry = np.clip(_ripples(3.7 * x, 3.1 * z) * 1.2, 0, 1)[:, None] * 0.7
    color = color * (1 - dry) + np.array((0.62, 0.5, 0.26)) * dry
    rock = np.clip((0.86 - up) * 6.0 + (y - 105.0) / 50.0, 0, 1)[:, None]
    color = color * (1 - rock) + np.array((0.44, 0.38, 0.33)) * rock
    snow = np.clip((y - 138.0 - 22.0 * ripples) / 10.0, 0, 1)[:, None]
    color = color * (1 - snow) + np.array((1.0, 1.0, 1.0)) * snow
    sand = np.clip(1.0 - (y - 0.2) / 1.3, 0, 1)[:, None]
    return np.asarray(color * (1 - sand) + np.array((0.75, 0.62, 0.42)) * sand)
