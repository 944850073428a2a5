"""Where lines along one axis cross a mesh: the samples that height fields are made of.

Risser, "True Impostors" (GPU Gems 3, ch. 21, section 21.2): a texel of a height field stands for a
column through the object, and holds the heights at which the column enters and leaves it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Crossings(NamedTuple):
    """Crossings of all columns, by column, in a column by height.

    Attributes:
        starts: (resolution² + 1,) int64, where each column's crossings begin; column y * res + x.
        height: (n,) float64, along the axis, in [0, 1] of the box.
        enters: (n,) bool, whether the column enters the object there, going up.
        triangle: (n,) int64.
        weights: (n, 3) float64, barycentric coordinates in the triangle.
    """

    starts: NDArray[np.int64]
    height: Floats
    enters: NDArray[np.bool_]
    triangle: NDArray[np.int64]
    weights: Floats


def cross_columns(corners: Floats, resolution: int) -> Crossings:
    """Cross triangles with the columns through the texels' centres.

    `corners` (m, 3, 3) float: the box scaled to [0, 1]³; columns run along the last coordinate,
    texel x along the first. A crossing on a shared edge counts for one of its triangles.
    """
    total = _cross(corners, resolution, *_room(0))
    room = _room(total)
    _cross(corners, resolution, *room)
    column, height, enters, triangle, weights = room
    order = np.lexsort((height, column))
    starts = np.searchsorted(column[order], np.arange(resolution**2 + 1))
    return Crossings(starts, height[order], enters[order], triangle[order], weights[order])


def _room(count: int) -> tuple[Any, ...]:
    return (
        np.empty(count, np.int64),
        np.empty(count),
        np.empty(count, np.bool_),
        np.empty(count, np.int64),
        np.empty((count, 3)),
    )


@njit(cache=True)
def _owns(dx: float, dy: float) -> bool:
    """Whether points on an edge belong to it, so that of two triangles exactly one has them."""
    return dy > 0 or (dy == 0 and dx < 0)


@njit(cache=True)
def _cross(
    corners: Floats,
    resolution: int,
    column: NDArray[np.int64],
    height: Floats,
    enters: NDArray[np.bool_],
    triangle: NDArray[np.int64],
    weights: Floats,
) -> int:
    """Write the crossings if there is room; returns their number."""
    count = 0
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0] * resolution - 0.5
        bx, by, bz = corners[t, 1] * resolution - 0.5
        cx, cy, cz = corners[t, 2] * resolution - 0.5
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        # Seen from above a front face turns left, and the column leaves through it.
        leaves = area > 0
        sign = 1.0 if leaves else -1.0
        for y in range(
            max(0, int(np.ceil(min(ay, by, cy)))),
            min(resolution - 1, int(np.floor(max(ay, by, cy)))) + 1,
        ):
            for x in range(
                max(0, int(np.ceil(min(ax, bx, cx)))),
                min(resolution - 1, int(np.floor(max(ax, bx, cx)))) + 1,
            ):
                a = sign * ((bx - x) * (cy - y) - (by - y) * (cx - x))
                b = sign * ((cx - x) * (ay - y) - (cy - y) * (ax - x))
                c = sign * ((ax - x) * (by - y) - (ay - y) * (bx - x))
                if a < 0 or b < 0 or c < 0:
                    continue
                if a == 0 and not _owns(sign * (cx - bx), sign * (cy - by)):
                    continue
                if b == 0 and not _owns(sign * (ax - cx), sign * (ay - cy)):
                    continue
                if c == 0 and not _owns(sign * (bx - ax), sign * (by - ay)):
                    continue
                if len(column):
                    whole = a + b + c
                    column[count] = y * resolution + x
                    z = (a * az + b * bz + c * cz) / whole
                    height[count] = (z + 0.5) / resolution
                    enters[count] = not leaves
                    triangle[count] = t
                    weights[count, 0] = a / whole
                    weights[count, 1] = b / whole
                    weights[count, 2] = c / whole
                count += 1
    return count
