"""Gap filling for surfaces that skip layers, which the paper's rule (`gaps`) leaves open.

Ground, water and walls seen at a slant may pass several layers from one texel p to the next one of
its row or column q, on layers i and j > i + 1. Layers shift against each other one by one, so every
one of i ... j - 1 gets a texel at q, in q's colour: any two neighbours in that ladder touch, from
every eye.

But most jumps are silhouettes, where nothing should be filled. They are told apart by disparity,
which on any plane is affine in the face's coordinates: the line through p and q, continued by as
much, must meet a third fragment behind p and a fourth before q. Curved and tessellated surfaces
meet it roughly, `IN_LINE`; where only one end does, at the edge of a surface, it has to be met
nearly exactly, `EXACT`. Measured in docs/quality.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.compile.bitplanes import Planes
from farfield_worker.render.interface import FaceTexels

#: how far third and fourth fragment may be off the line, in parts of the jump in disparity
IN_LINE = 0.25
#: the same where there is only one of them
EXACT = 0.01
#: most layers that a surface may pass from texel to texel and still be filled
REACH = 8


@njit(cache=True)
def _off(starts: Any, disparity: Any, resolution: int, row: int, column: int, wanted: float) -> Any:
    """How far the fragments at a texel are off the `wanted` disparity; infinite without any."""
    least = np.inf
    if 0 <= row < resolution and 0 <= column < resolution:
        texel = row * resolution + column
        for n in range(starts[texel], starts[texel + 1]):
            least = min(least, abs(disparity[n] - wanted))
    return least


@njit(cache=True)
def _mark(starts: Any, layer: Any, disparity: Any, closed: Any, out: Any, rings: int) -> None:
    layers, resolution, _ = out.shape
    for q in range(resolution * resolution):
        row, column = divmod(q, resolution)
        word, bit = column >> 6, np.uint64(1) << np.uint64(column & 63)
        for at in range(starts[q], starts[q + 1]):
            j = layer[at]
            open_ = False
            for i in range(max(j - REACH, 0), min(j, layers)):
                open_ = open_ or closed[i, row, word] & bit == 0
            if not open_:
                continue
            lowest = j  # the farthest layer that this fragment is continued on
            for side in range(4 * rings):
                reach = side // 4 + 1
                down, across = ((reach, 0), (-reach, 0), (0, reach), (0, -reach))[side % 4]
                if not (0 <= row - down < resolution and 0 <= column - across < resolution):
                    continue
                p = q - down * resolution - across
                for n in range(starts[p], starts[p + 1]):
                    i = layer[n]
                    if i >= min(lowest, j - 1):
                        break
                    if i < j - REACH:
                        continue
                    step = disparity[at] - disparity[n]
                    behind = _off(
                        starts,
                        disparity,
                        resolution,
                        row - 2 * down,
                        column - 2 * across,
                        disparity[n] - step,
                    )
                    before = _off(
                        starts,
                        disparity,
                        resolution,
                        row + down,
                        column + across,
                        disparity[at] + step,
                    )
                    if max(behind, before) <= IN_LINE * step or min(behind, before) <= EXACT * step:
                        lowest = i
                        break
            for i in range(lowest, min(j, layers)):
                if closed[i, row, word] & bit == 0:
                    out[i, row, word] |= bit


def fill_steep(texels: FaceTexels, starts: NDArray[np.int64], closed: Planes, rings: int) -> Planes:
    """Texels that close gaps over skipped layers: (N, R, words) uint64, none of them in `closed`.

    `texels` may have layers beyond N, and `starts` are their `gaps.columns`. `closed` (N, R, words)
    are the texels that need none, covered or hidden. `rings` is the largest shift between
    neighbouring layers in whole texels: how far apart p and q may be.
    """
    out = np.zeros_like(closed)
    _mark(starts, texels.layer, 1 / texels.depth.astype(np.float64), closed, out, rings)
    return out
