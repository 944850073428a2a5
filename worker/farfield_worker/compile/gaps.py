"""Gap filling: no background between the pieces of one surface (LEMI section 5).

A surface that comes nearer from one texel p to its neighbour q, on layers i < j, is cut between
them, and as the eye moves layer j shifts against layer i: a gap opens. The farther layer is
therefore continued under the nearer one. The paper's case is j = i + 1 and a shift of at most one
texel: layer i gets a texel at q as well, in q's colour. Neighbours are the eight around a texel,
since layers shift by up to a texel along both axes at once.

A steep surface skips layers (j > i + 1). The layers between shift by up to one texel each, so
every one of i ... j - 1 gets a texel at q: any two neighbours in that ladder touch. But most jumps
are silhouettes, where nothing should be filled. They are told apart by disparity, which on any
plane is affine in the face's coordinates: the surface goes on from p to q if the line through both
meets a third fragment next to p or next to q.

Layers from N on are no layers but what lies just inside the near field: they are filled under like
any other, so that no gap opens at the near border, and are not stored.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.compile.bitplanes import Planes
from farfield_worker.render.interface import FaceTexels

#: a third fragment is in line if it is off by at most this share of the jump in disparity
IN_LINE = 0.25


@njit(cache=True)
def _near_line(columns, disparity, texel, wanted, tolerance):
    for n in range(columns[texel], columns[texel + 1]):
        if abs(disparity[n] - wanted) <= tolerance:
            return True
    return False


@njit(cache=True)
def _mark(columns, layer, disparity, planes, out, rings, reach):
    """Set in `out` the bits to fill; `planes` are the covered texels of the same layers."""
    layers, resolution, _ = out.shape
    for q in range(resolution * resolution):
        row, column = divmod(q, resolution)
        word, bit = column >> 6, np.uint64(1) << np.uint64(column & 63)
        for at in range(columns[q], columns[q + 1]):
            j = layer[at]
            if j == 0:
                continue
            lowest = j  # the farthest layer this fragment must be continued on
            for other_row in range(max(row - rings, 0), min(row + rings + 1, resolution)):
                for other_column in range(
                    max(column - rings, 0), min(column + rings + 1, resolution)
                ):
                    p = other_row * resolution + other_column
                    for n in range(columns[p], columns[p + 1]):
                        i = layer[n]
                        if i >= lowest:
                            break
                        if i < j - reach:
                            continue
                        if i < j - 1:
                            step = disparity[at] - disparity[n]
                            tolerance = IN_LINE * abs(step)
                            before_row, before_column = (
                                2 * other_row - row,
                                2 * other_column - column,
                            )
                            after_row, after_column = 2 * row - other_row, 2 * column - other_column
                            if not (
                                0 <= before_row < resolution
                                and 0 <= before_column < resolution
                                and _near_line(
                                    columns,
                                    disparity,
                                    before_row * resolution + before_column,
                                    disparity[n] - step,
                                    tolerance,
                                )
                            ) and not (
                                0 <= after_row < resolution
                                and 0 <= after_column < resolution
                                and _near_line(
                                    columns,
                                    disparity,
                                    after_row * resolution + after_column,
                                    disparity[at] + step,
                                    tolerance,
                                )
                            ):
                                continue
                        lowest = i
                        break
            for i in range(lowest, min(j, layers)):
                if planes[i, row, word] & bit == 0:
                    out[i, row, word] |= bit


def columns(texels: FaceTexels, resolution: int) -> NDArray[np.int64]:
    """First fragment of each texel, and their number last: (resolution ** 2 + 1,) int64."""
    out = np.zeros(resolution * resolution + 1, np.int64)
    np.cumsum(np.bincount(texels.texel, minlength=resolution * resolution), out=out[1:])
    return out


def fill_gaps(
    texels: FaceTexels, starts: NDArray[np.int64], planes: Planes, rings: int, reach: int
) -> Planes:
    """Texels that close the gaps between layers: (N, R, words) uint64, none of them in `planes`.

    `texels` may have layers beyond N, and `starts` are its `columns`; `planes` (N, R, words) are
    its texels on the N layers. `rings` is the largest shift between neighbouring layers in whole
    texels, `reach` the most layers a surface may pass from texel to texel and still be filled: 1 is
    the paper's rule.
    """
    out = np.zeros_like(planes)
    _mark(starts, texels.layer, 1 / texels.depth, planes, out, rings, reach)
    return out


@njit(cache=True)
def sources(starts, layer, texel, on):
    """Whose colour texels (n,) on layers `on` (n,) take, own or filled: (n,) int64 fragments.

    It is the fragment there or, if the texel was filled, the next one in front of it. `starts` are
    the `columns` of the fragments with layers `layer`.
    """
    out = np.empty(texel.size, np.int64)
    for n in range(texel.size):
        at = starts[texel[n]]
        while layer[at] < on[n]:
            at += 1
        out[n] = at
    return out
