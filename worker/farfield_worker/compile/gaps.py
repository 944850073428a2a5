"""Gap filling: no background between the pieces of one surface (LEMI section 5).

A surface that comes nearer from one texel p to its neighbour q, on layers i and i + 1, is cut
between them, and as the eye moves layer i + 1 shifts against layer i: a gap opens. The farther
layer is therefore continued under the nearer one: it gets a texel at q as well, in q's colour.
Neighbours are the eight around a texel, since layers shift by up to a texel along both axes at
once; where layers may shift by more, the neighbourhood is larger by as much.

A surface so steep that it passes several layers from one texel to the next is not filled, as in
the paper; `steep` does that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.compile.bitplanes import Planes, dilate


def fill_gaps(planes: Planes, rings: int) -> Planes:
    """Texels that close the gaps between layers: (N - 1, R, words) uint64, none of them covered.

    `planes` are the covered texels, (N, R, words); the nearest layer only continues the next one.
    `rings` is the largest shift between neighbouring layers in whole texels.
    """
    out = planes[1:] & ~planes[:-1]
    for i in np.flatnonzero(out.any(axis=(1, 2))):
        out[i] &= dilate(planes[i], rings)
    return out


def columns(texel: NDArray[np.int32], resolution: int) -> NDArray[np.int64]:
    """First of the fragments of each texel, and their number last: (resolution ** 2 + 1,) int64.

    Fragments, `texel` (n,), are sorted by texel.
    """
    out = np.zeros(resolution * resolution + 1, np.int64)
    np.cumsum(np.bincount(texel, minlength=resolution * resolution), out=out[1:])
    return out


@njit(cache=True)
def sources(starts: Any, layer: Any, texel: Any, on: Any) -> Any:
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
