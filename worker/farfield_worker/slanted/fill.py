"""The texels that a sheet draws: those it captured and a ring of one texel around them.

Seen from off the centre, two sheets that meet at an edge part by up to twice the tolerance, and a
sliver of background shows between them. So every sheet goes on for one texel (8-connected), where
the surface truly goes on: where a fragment lies within *two* tolerances of the plane. A filled
texel may thus exceed the bound that captured texels keep; it is flagged, and its share reported.

One of the two sheets is enough to close the sliver: the one that lies behind there, so that its
ring covers nothing as long as the two have not parted. The other one's ring is left out, unless the
sheet behind cannot reach over.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.grid import drawable, value
from farfield_worker.slanted.segment import Sheets

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class SheetTexels(NamedTuple):
    """What each sheet draws; sheet s has the entries starts[s] to starts[s + 1].

    Attributes:
        rect: (s, 4) int32, first column and row, end column and row, of what it draws.
        starts: (s + 1,) int32.
        texel: (m,) int32, row * resolution + column.
        fragment: (m,) int32, the fragment that it draws.
        filled: (m,) bool, whether it belongs to the ring.
    """

    rect: Ints
    starts: Ints
    texel: Ints
    fragment: Ints
    filled: NDArray[np.bool_]


def fill(
    sheets: Sheets,
    starts: Ints,
    disparity: Floats,
    low2: Floats,
    high2: Floats,
    resolution: int,
) -> SheetTexels:
    """Texels of all sheets, ring included.

    `starts` (resolution^2 + 1,) is the first fragment of each texel, nearest first; `disparity`
    (n,) and the interval `low2`, `high2` (n,) of two tolerances around it are the fragments'.
    """
    most = 4 * len(sheets.owner) + 64
    while True:
        rect = sheets.rect.copy()
        ends = np.zeros(len(rect) + 1, np.int32)
        texel, fragment = np.empty(most, np.int32), np.empty(most, np.int32)
        filled = np.empty(most, np.bool_)
        count = _fill(
            sheets.owner,
            sheets.plane,
            starts,
            disparity,
            low2,
            high2,
            resolution,
            rect,
            ends,
            texel,
            fragment,
            filled,
        )
        if count <= most:
            return SheetTexels(
                rect, ends, texel[:count].copy(), fragment[:count].copy(), filled[:count].copy()
            )
        most = count


@njit(cache=True)
def _captured(owner: Any, starts: Any, cell: int, sheet: int) -> int:
    """Nearest fragment of texel `cell` that belongs to `sheet`, -1 if none."""
    for f in range(starts[cell], starts[cell + 1]):
        if owner[f] == sheet:
            return int(f)
    return -1


@njit(cache=True)
def continues(
    plane: Any,
    starts: Any,
    disparity: Any,
    low2: Any,
    high2: Any,
    resolution: int,
    x: int,
    y: int,
) -> int:
    """Fragment of texel (x, y) closest to the plane within two tolerances, -1 if none."""
    if not drawable(resolution, x, y, plane[0], plane[1], plane[2]):
        return -1
    d = value(resolution, x, y, plane[0], plane[1], plane[2])
    cell = y * resolution + x
    best, best_step = -1, np.inf
    for f in range(starts[cell], starts[cell + 1]):
        step = abs(disparity[f] - d)
        if low2[f] <= d <= high2[f] and step < best_step:
            best, best_step = f, step
    return best


@njit(cache=True)
def _leads(planes: Any, s: int, other: int, x: int, y: int, resolution: int) -> bool:
    """Whether the ring between sheets s and `other` is that of s, which lies behind.

    (x, y) is the sum of the two texels' columns and rows.
    """
    # the centre of texel (x / 2, y / 2), by the planes' slopes in texels
    u, v = (x + 1.0) / resolution - 1.0, (y + 1.0) / resolution - 1.0
    ours = planes[s, 0] * u + planes[s, 1] * v + planes[s, 2]
    its = planes[other, 0] * u + planes[other, 1] * v + planes[other, 2]
    return bool(ours < its or (ours == its and s < other))


@njit(cache=True)
def _reaches(
    owner: Any,
    planes: Any,
    starts: Any,
    disparity: Any,
    low2: Any,
    high2: Any,
    resolution: int,
    sheet: int,
    x: int,
    y: int,
    fragment: int,
) -> bool:
    """Whether `sheet` draws texel (x, y): captured there, or its ring over `fragment`."""
    if _captured(owner, starts, y * resolution + x, sheet) >= 0:
        return True
    f = continues(planes[sheet], starts, disparity, low2, high2, resolution, x, y)
    return bool(f == fragment)


@njit(cache=True)
def _needed(
    owner: Any,
    planes: Any,
    starts: Any,
    disparity: Any,
    low2: Any,
    high2: Any,
    resolution: int,
    own: Any,
    x0: int,
    y0: int,
    s: int,
    f: int,
    x: int,
    y: int,
) -> bool:
    """Whether the ring of sheet s must draw fragment f at (x, y): f's own sheet does not close it.

    `own` (h, w) is what s has captured from (x0, y0) on, -1 where nothing.
    """
    other = owner[f]
    if other < 0:
        return True
    for ny in range(max(y - 1, y0), min(y + 2, y0 + own.shape[0])):
        for nx in range(max(x - 1, x0), min(x + 2, x0 + own.shape[1])):
            g = own[ny - y0, nx - x0]
            if g < 0:
                continue
            if _leads(planes, s, other, x + nx, y + ny, resolution) or not _reaches(
                owner, planes, starts, disparity, low2, high2, resolution, other, nx, ny, g
            ):
                return True
    return False


@njit(cache=True)
def _fill(
    owner: Any,
    planes: Any,
    starts: Any,
    disparity: Any,
    low2: Any,
    high2: Any,
    resolution: int,
    rects: Any,
    ends: Any,
    texel: Any,
    fragment: Any,
    filled: Any,
) -> int:
    """Write the texels of all sheets and grow their rectangles; return how many there are.

    Counts on without writing where the arrays are too short.
    """
    count = 0
    for s in range(len(rects)):
        x0, y0 = max(rects[s, 0] - 1, 0), max(rects[s, 1] - 1, 0)
        x1, y1 = min(rects[s, 2] + 1, resolution), min(rects[s, 3] + 1, resolution)
        own = np.empty((y1 - y0, x1 - x0), np.int32)
        for y in range(y0, y1):
            for x in range(x0, x1):
                own[y - y0, x - x0] = _captured(owner, starts, y * resolution + x, s)
        for y in range(y0, y1):
            for x in range(x0, x1):
                f = own[y - y0, x - x0]
                ring = False
                if f < 0:
                    for ny in range(max(y - 1, y0), min(y + 2, y1)):
                        for nx in range(max(x - 1, x0), min(x + 2, x1)):
                            ring = ring or own[ny - y0, nx - x0] >= 0
                    if ring:
                        f = continues(planes[s], starts, disparity, low2, high2, resolution, x, y)
                        if f >= 0 and not _needed(
                            owner,
                            planes,
                            starts,
                            disparity,
                            low2,
                            high2,
                            resolution,
                            own,
                            x0,
                            y0,
                            s,
                            f,
                            x,
                            y,
                        ):
                            f = -1
                if f < 0:
                    continue
                if count < len(texel):
                    texel[count] = y * resolution + x
                    fragment[count] = f
                    filled[count] = ring
                count += 1
                rects[s, 0], rects[s, 1] = min(rects[s, 0], x), min(rects[s, 1], y)
                rects[s, 2], rects[s, 3] = max(rects[s, 2], x + 1), max(rects[s, 3], y + 1)
        ends[s + 1] = count
    return count
