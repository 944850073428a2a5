"""Take what is seen a little further along its surface.

Sampling from a few eyes misses what shows only through small gaps between near things, from places
between the samples. What shows there mostly continues a surface that some eye does see. So
fragments count as seen if a fragment within a few texels is, and lies on the same surface: next to
it texel by texel, within a tolerance of its disparity. Measured on the road to the medieval town's
gate: one texel brings missing pixels from 1.7e-3 of the far field to 8.3e-4, for 15 % more texels;
two texels within three tolerances bring 3.9e-4, for 40 % more.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.grid import texel_starts
from farfield_worker.slanted.tolerance import Tolerance, highest, lowest

Mask = NDArray[np.bool_]

#: tolerances between neighbouring fragments of one surface
STEP = 1.0


def spread(
    texel: NDArray[np.int32],
    disparity: NDArray[np.floating],
    seen: Mask,
    tolerance: Tolerance,
    resolution: int,
    texels: int,
) -> Mask:
    """Fragments within `texels` steps of ones that are `seen` (n,): (n,) bool.

    `texel` (n,), sorted, and `disparity` (n,), 1/m, are the fragments'; a step leads to any of the
    nine texels around.
    """
    starts = texel_starts(texel, resolution)
    result = seen.copy()
    front = np.flatnonzero(seen).astype(np.int32)
    for _ in range(texels):
        front = _step(texel, starts, disparity, tolerance.steps(STEP), front, result, resolution)
    return result


@njit(cache=True)
def _step(
    texel: Any, starts: Any, disparity: Any, steps: Any, front: Any, seen: Any, resolution: int
) -> Any:
    """Mark in `seen` the fragments next to those of `front` (m,); return the new ones."""
    new = np.empty(len(seen), np.int32)
    count = 0
    for i in front:
        x, y = texel[i] % resolution, texel[i] // resolution
        for ny in range(max(y - 1, 0), min(y + 2, resolution)):
            # the fragments of up to three neighbouring texels lie in one run
            first = starts[ny * resolution + max(x - 1, 0)]
            end = starts[ny * resolution + min(x + 1, resolution - 1) + 1]
            for j in range(first, end):
                if seen[j]:
                    continue
                d = float(disparity[j])
                if lowest(d, steps) <= disparity[i] <= highest(d, steps):
                    seen[j] = True
                    new[count] = j
                    count += 1
    return new[:count].copy()
