"""From crossings to slabs: the stretches of each column that lie inside the object.

Two slabs fill the four channels of one texture (Risser, section 21.2.1). A closed mesh is inside
where more surfaces have been entered than left, so overlapping parts become one. A mesh that is not
closed has no inside: each of its sheets becomes a slab as thick as a texel and as the sheet rises
within its column, so that steep sheets have no holes between columns. A column with more
slabs than there are textures for has its narrowest gaps closed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.objects.columns import Crossings, Floats


class Slabs(NamedTuple):
    """Slabs of all columns, from below.

    Attributes:
        low, high: (slabs, resolution, resolution) float64 in [0, 1]; low > high where there is
            none.
        surface: (slabs, 2, resolution, resolution) int64, the crossing that low and high lie on, -1
            where there is none.
        closed: by how much gaps were filled, as a share of all that is solid.
    """

    low: Floats
    high: Floats
    surface: NDArray[np.int64]
    closed: float


def is_closed(triangles: NDArray[np.int64]) -> bool:
    """Whether every edge of `triangles` (m, 3), welded by place, has one on its other side."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    count = int(triangles.max(initial=0)) + 1
    there, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    return bool((np.sort(there) == np.sort(back)).all())


def make_slabs(
    crossings: Crossings, resolution: int, count: int, closed: bool, half: Floats
) -> Slabs:
    """At most `count` slabs a column; open sheets reach `half` (crossings,) to both sides."""
    low = np.full((count, resolution**2), 1.0)
    high = np.zeros((count, resolution**2))
    surface = np.full((count, 2, resolution**2), -1, np.int64)
    most = int(np.diff(crossings.starts).max(initial=0)) + 1
    filled, solid = _collect(
        crossings.starts,
        crossings.height,
        crossings.enters,
        closed,
        half,
        np.empty((most, 2)),
        np.empty((most, 2), np.int64),
        low,
        high,
        surface,
    )
    shape = (count, resolution, resolution)
    return Slabs(
        low.reshape(shape),
        high.reshape(shape),
        surface.reshape(count, 2, resolution, resolution),
        filled / solid if solid > 0 else 0.0,
    )


@njit(cache=True)
def _collect(starts, height, enters, closed, half, spans, sides, low, high, surface):  # type: ignore[no-untyped-def]
    filled = 0.0
    solid = 0.0
    for column in range(len(starts) - 1):
        n = 0
        depth = 0
        for i in range(starts[column], starts[column + 1]):
            if closed:
                depth += 1 if enters[i] else -1
                if enters[i] and depth == 1:
                    spans[n, 0], sides[n, 0] = height[i], i
                elif not enters[i] and depth == 0:
                    spans[n, 1], sides[n, 1] = height[i], i
                    n += 1
                continue
            spans[n, 0], spans[n, 1] = height[i] - half[i], height[i] + half[i]
            sides[n, 0], sides[n, 1] = i, i
            while n > 0 and spans[n, 0] <= spans[n - 1, 1]:
                if spans[n, 0] < spans[n - 1, 0]:
                    spans[n - 1, 0], sides[n - 1, 0] = spans[n, 0], sides[n, 0]
                if spans[n, 1] > spans[n - 1, 1]:
                    spans[n - 1, 1], sides[n - 1, 1] = spans[n, 1], sides[n, 1]
                n -= 1
            n += 1
        while n > low.shape[0]:
            filled += _fill_narrowest(spans, sides, n)
            n -= 1
        for k in range(n):
            low[k, column] = max(0.0, spans[k, 0])
            high[k, column] = min(1.0, spans[k, 1])
            surface[k, 0, column], surface[k, 1, column] = sides[k, 0], sides[k, 1]
            solid += high[k, column] - low[k, column]
    return filled, solid


@njit(cache=True)
def _fill_narrowest(spans, sides, n):  # type: ignore[no-untyped-def]
    """Close the narrowest gap between `n` slabs; returns how wide it was."""
    best = 1
    for k in range(2, n):
        if spans[k, 0] - spans[k - 1, 1] < spans[best, 0] - spans[best - 1, 1]:
            best = k
    width = spans[best, 0] - spans[best - 1, 1]
    spans[best - 1, 1], sides[best - 1, 1] = spans[best, 1], sides[best, 1]
    for k in range(best, n - 1):
        spans[k, 0], spans[k, 1] = spans[k + 1, 0], spans[k + 1, 1]
        sides[k, 0], sides[k, 1] = sides[k + 1, 0], sides[k + 1, 1]
    return width
