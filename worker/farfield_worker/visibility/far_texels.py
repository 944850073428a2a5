"""Which far texels the eyes of a view cell can see.

Texels are points on the planes they are drawn on. For each eye they are entered into its near maps
as a depth buffer, so near polygons hide them and they hide one another. A texel counts as seen if
nothing lies before it in its map's texel, or in one of the eight around. A map has at most one
texel where a face has two each way, so texels that adjoin on a layer leave no holes in it; where
they do, more is kept. Texels of the next layer hide nothing: surfaces pass from one to the next,
and LEMI's own removal of hidden texels deals with them (compile/hidden.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from farfield_core.faces import FACES
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.near_maps import NearMap, farthest_around

Floats = NDArray[np.float64]

#: axes of all faces, (6, 3, 3): right, down, forward
_AXES = np.array([[f.right, f.down, f.forward] for f in FACES])


class FarTexels:
    """Watches points of the far field.

    `points` (n, 3) are scene coordinates; `slack` (n,) is the share by which something's disparity
    may exceed a point's without hiding it.

    Attributes:
        seen: (n,) bool.
    """

    def __init__(self, points: Floats, slack: Floats) -> None:
        self.seen = np.zeros(len(points), np.bool_)
        self._points, self._slack = points, slack
        self._place = np.empty(len(points), np.int32)
        self._disparity = np.empty(len(points), np.float32)

    def look(self, eye: Floats, maps: Sequence[NearMap]) -> float:
        """See `sampling.Watcher`."""
        nearest = np.stack([near_map.solid for near_map in maps])
        resolution = nearest.shape[1]
        flat = nearest.reshape(-1)
        _enter(self._points, eye, _AXES, resolution, self._place, self._disparity, flat)
        around = np.stack([farthest_around(face) for face in nearest]).reshape(-1)
        new = _test(self._place, self._disparity, self._slack, flat, around, self.seen)
        return float(new) / len(flat)


@njit(cache=True)
def _enter(
    points: Any, eye: Any, axes: Any, resolution: int, place: Any, disparity: Any, nearest: Any
) -> None:
    """Find each point's texel in the six maps, and its disparity; keep the greatest of a texel."""
    q = np.empty(3)
    for i in range(len(points)):
        axis = 0
        for a in range(3):
            q[a] = points[i, a] - eye[a]
            if abs(q[a]) > abs(q[axis]):
                axis = a
        k = 2 * axis + (1 if q[axis] < 0.0 else 0)
        right = q[0] * axes[k, 0, 0] + q[1] * axes[k, 0, 1] + q[2] * axes[k, 0, 2]
        down = q[0] * axes[k, 1, 0] + q[1] * axes[k, 1, 1] + q[2] * axes[k, 1, 2]
        depth = abs(q[axis])
        column = min(int((right / depth + 1.0) * 0.5 * resolution), resolution - 1)
        row = min(int((down / depth + 1.0) * 0.5 * resolution), resolution - 1)
        place[i] = (k * resolution + row) * resolution + column
        disparity[i] = 1.0 / depth
        nearest[place[i]] = max(nearest[place[i]], disparity[i])


@njit(cache=True)
def _test(place: Any, disparity: Any, slack: Any, nearest: Any, around: Any, seen: Any) -> int:
    """Mark the points before which nothing lies; how many texels first show one of them."""
    new = 0
    for i in range(len(place)):
        if seen[i]:
            continue
        reach = disparity[i] * (1.0 + slack[i])
        if around[place[i]] <= reach:
            seen[i] = True
            if nearest[place[i]] == disparity[i]:
                new += 1
    return new
