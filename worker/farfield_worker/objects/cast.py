"""Rays into height fields, on the processor: the same march as the viewer's shader.

Risser, section 21.3: a linear march finds the first step inside, a binary search between it and the
step before finds the surface.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.objects.fields import Fields

Floats = NDArray[np.float64]


def cast_rays(fields: Fields, origins: Floats, directions: Floats, steps: int) -> Floats:
    """Distances at which rays (n, 3), metres, first meet the object, in lengths of `directions`.

    inf where they miss; `steps` are taken across the box's diagonal.
    """
    axes = list(fields.axes)
    extent = (fields.high - fields.low)[axes]
    o = (origins - fields.low)[:, axes] / extent
    d = directions[:, axes] / extent
    return np.asarray(_cast(fields.heights, o, d, steps), np.float64)


@njit(cache=True)
def _inside(heights: NDArray[np.uint8], x: float, y: float, z: float) -> bool:
    size = heights.shape[1]
    i, j = int(np.floor(x * size)), int(np.floor(y * size))
    if i < 0 or j < 0 or i >= size or j >= size:
        return False
    level = 255.0 * z
    for texture in range(heights.shape[0]):
        for pair in (0, 2):
            low, high = heights[texture, j, i, pair], heights[texture, j, i, pair + 1]
            if low <= level <= high:
                return True
    return False


@njit(cache=True)
def _cast(heights: NDArray[np.uint8], origins: Floats, directions: Floats, steps: int) -> Floats:
    found = np.full(len(origins), np.inf)
    for n in range(len(origins)):
        first, last = 0.0, np.inf
        for axis in range(3):
            if directions[n, axis] == 0:
                if origins[n, axis] < 0 or origins[n, axis] > 1:
                    last = -1.0
                continue
            a = -origins[n, axis] / directions[n, axis]
            b = (1 - origins[n, axis]) / directions[n, axis]
            first, last = max(first, min(a, b)), min(last, max(a, b))
        if last <= first:
            continue
        # number by number: arrays of three would be allocated at every step
        ox, oy, oz = origins[n, 0], origins[n, 1], origins[n, 2]
        dx, dy, dz = directions[n, 0], directions[n, 1], directions[n, 2]
        step = np.sqrt(3.0) / (np.sqrt(dx * dx + dy * dy + dz * dz) * steps)
        t = first + 0.5 * step
        while t < last:
            if _inside(heights, ox + t * dx, oy + t * dy, oz + t * dz):
                before, after = max(first, t - step), t
                for _ in range(6):
                    middle = (before + after) / 2
                    if _inside(heights, ox + middle * dx, oy + middle * dy, oz + middle * dz):
                        after = middle
                    else:
                        before = middle
                found[n] = after
                break
            t += step
    return found
