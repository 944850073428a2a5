"""Small sheets whose fragments the rings of their neighbours draw anyway are given up.

A ring (slanted/fill.py) draws a fragment beside its sheet that lies within two tolerances of the
plane. Where the sheets around a small one reach all of its fragments so, it need not be drawn: its
texels become filled ones, flagged as such. The smallest go first, and a sheet whose ring is counted
on stays.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.fill import continues
from farfield_worker.slanted.segment import Sheets

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: fragments that a sheet may have captured to be given up
MOST = 16


def absorb(
    sheets: Sheets,
    texel: Ints,
    starts: Ints,
    disparity: Floats,
    low2: Floats,
    high2: Floats,
    resolution: int,
) -> Sheets:
    """The sheets without those that their neighbours draw; their fragments are captured by none.

    `texel` (n,) is where each fragment is seen; the rest as in `fill.fill`.
    """
    captured = np.flatnonzero(sheets.owner >= 0).astype(np.int32)
    captured = captured[np.argsort(sheets.owner[captured], kind="stable")]
    ends = np.searchsorted(sheets.owner[captured], np.arange(len(sheets.rect) + 1))
    size = np.diff(ends)
    small = np.flatnonzero(size <= MOST)
    small = small[np.argsort(size[small], kind="stable")]
    keep = np.ones(len(size), np.bool_)
    _absorb(
        sheets.owner,
        sheets.plane,
        captured,
        ends,
        small,
        texel,
        starts,
        disparity,
        low2,
        high2,
        resolution,
        keep,
    )
    return sheets.take(keep)


@njit(cache=True)
def _absorb(
    owner: Any,
    planes: Any,
    captured: Any,
    ends: Any,
    small: Any,
    texel: Any,
    starts: Any,
    disparity: Any,
    low2: Any,
    high2: Any,
    resolution: int,
    keep: Any,
) -> None:
    """Clear `keep` (s,) of the sheets that are given up, looking at `small` in turn."""
    counted_on = np.zeros(len(keep), np.bool_)
    helpers = np.empty(MOST, np.int32)
    for s in small:
        if counted_on[s]:
            continue
        drawn = True
        for n in range(ends[s], ends[s + 1]):
            f = captured[n]
            x, y = texel[f] % resolution, texel[f] // resolution
            helper = -1
            for ny in range(max(y - 1, 0), min(y + 2, resolution)):
                for nx in range(max(x - 1, 0), min(x + 2, resolution)):
                    if helper >= 0 or (nx == x and ny == y):
                        continue
                    cell = ny * resolution + nx
                    for g in range(starts[cell], starts[cell + 1]):
                        other = owner[g]
                        if other < 0 or other == s or not keep[other]:
                            continue
                        if f == continues(
                            planes[other], starts, disparity, low2, high2, resolution, x, y
                        ):
                            helper = other
                            break
            if helper < 0:
                drawn = False
                break
            helpers[n - ends[s]] = helper
        if drawn:
            keep[s] = False
            for n in range(ends[s + 1] - ends[s]):
                counted_on[helpers[n]] = True
