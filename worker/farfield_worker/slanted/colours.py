"""Whose colour each texel of a sheet shows: its own fragment's, or that of a texel beside it.

Some texels are there for slits and slivers only: those that no sampled eye sees, taken in because
they go on from ones that are seen (visibility/spread.py), and filled ones that lie behind the sheet
whose fragment they draw (slanted/fill.py). Little of them ever shows. So they repeat the nearest
texel of their sheet that is seen, within REACH: above or below if there is one, or else beside, or
else at a corner. A PNG's filters make zeros of what repeats: in the medieval town it has a tenth
fewer bytes and no more wrong pixels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.fill import SheetTexels
from farfield_worker.slanted.grid import value
from farfield_worker.slanted.segment import Sheets

#: how far to look for a texel that is seen, in texels
REACH = 2


def shown(
    sheets: Sheets, texels: SheetTexels, seen: NDArray[np.bool_], resolution: int
) -> NDArray[np.int32]:
    """Fragment whose colour each of `texels` shows, (m,) int32; `seen` (n,) are the fragments'."""
    result = texels.fragment.copy()
    _repeat(
        sheets.owner,
        sheets.plane,
        seen,
        texels.rect,
        texels.starts,
        texels.texel,
        texels.fragment,
        texels.filled,
        resolution,
        result,
    )
    return result


@njit(cache=True)
def _behind(planes: Any, s: int, other: int, x: int, y: int, resolution: int) -> bool:
    """Whether plane s lies behind plane `other` at texel (x, y); without another it does not."""
    if other < 0:
        return False
    ours = value(resolution, x, y, planes[s, 0], planes[s, 1], planes[s, 2])
    its = value(resolution, x, y, planes[other, 0], planes[other, 1], planes[other, 2])
    return bool(ours < its)


@njit(cache=True)
def _nearest(firm: Any, x: int, y: int) -> int:
    """Entry of `firm` (h, w) nearest to (x, y) that is not -1, or -1 if none is within REACH."""
    for r in range(1, REACH + 1):
        best, least = -1, 4 * r
        for ny in range(max(y - r, 0), min(y + r + 1, firm.shape[0])):
            for nx in range(max(x - r, 0), min(x + r + 1, firm.shape[1])):
                across, along = abs(nx - x), abs(ny - y)
                cost = 2 * across + along - r  # r - r above, 2 r - r beside, up to 3 r - r
                if max(across, along) == r and firm[ny, nx] >= 0 and cost < least:
                    best, least = firm[ny, nx], cost
        if best >= 0:
            return int(best)
    return -1


@njit(cache=True)
def _repeat(
    owner: Any,
    planes: Any,
    seen: Any,
    rects: Any,
    starts: Any,
    texel: Any,
    fragment: Any,
    filled: Any,
    resolution: int,
    result: Any,
) -> None:
    for s in range(len(rects)):
        left, top = rects[s, 0], rects[s, 1]
        firm = np.full((rects[s, 3] - top, rects[s, 2] - left), -1, np.int32)
        for i in range(starts[s], starts[s + 1]):
            if not filled[i] and seen[fragment[i]]:
                firm[texel[i] // resolution - top, texel[i] % resolution - left] = fragment[i]
        for i in range(starts[s], starts[s + 1]):
            x, y = texel[i] % resolution, texel[i] // resolution
            if filled[i]:
                soft = _behind(planes, s, owner[fragment[i]], x, y, resolution)
            else:
                soft = not seen[fragment[i]]
            if soft:
                f = _nearest(firm, x - left, y - top)
                if f >= 0:
                    result[i] = f
