"""Which far texels the eyes of a view cell can see.

Texels are points on the planes they are drawn on. For each eye they are entered into its near maps
as a depth buffer, so near polygons hide them and they hide one another. A texel counts as seen if
nothing lies before it in its map's texel, or in one of the eight around. A map has at most one
texel where a face has two each way, so texels that adjoin on a layer leave no holes in it; where
they do, more is kept.

An eye between those sampled looks past near things at another angle, and through slits that none of
them sees through. So near polygons lose a margin of texels before they hide anything: the map then
stands for all eyes a step away, an occluder's depth times the margin's angle (P. Wonka, M. Wimmer,
D. Schmalstieg, "Visibility Preprocessing with Occluder Fusion", EGRW 2000, section 3: occluders
shrunk by the distance between samples). Measured in a street of the medieval town, as shares of the
far field missing at random eyes: 1.7e-3 without a margin, 5e-4 with it.

Texels of the next layer hide nothing: surfaces pass from one to the next, and LEMI's own removal of
hidden texels deals with them (compile/hidden.py).
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

#: texels of a map that near polygons lose all around
MARGIN = 4
#: of each face, which coordinates run right and down, (6, 2) int, and which way, (6, 2) float32
_ALONG = np.array([[abs(f.right).argmax(), abs(f.down).argmax()] for f in FACES])
_SIGN = np.array([[f.right.sum(), f.down.sum()] for f in FACES], np.float32)


class FarTexels:
    """Watches points of the far field.

    `points` (n, 3) are scene coordinates; `slack` (n,) is the share by which something's disparity
    may exceed a point's without hiding it.

    Attributes:
        seen: (n,) bool.
    """

    def __init__(self, points: Floats, slack: Floats) -> None:
        self.seen = np.zeros(len(points), np.bool_)
        # a million points are passed over for each eye: halve the memory that is read
        self._base = np.mean(points, axis=0) if len(points) else np.zeros(3)
        self._points = (points - self._base).astype(np.float32)
        self._reach = (1.0 + slack).astype(np.float32)
        self._place = np.empty(len(points), np.int32)
        self._disparity = np.empty(len(points), np.float32)

    def look(self, eye: Floats, maps: Sequence[NearMap]) -> float:
        """See `sampling.Watcher`."""
        nearest = np.stack([farthest_around(near_map.solid, MARGIN) for near_map in maps])
        resolution = nearest.shape[1]
        flat = nearest.reshape(-1)
        seen_from = (np.asarray(eye, np.float64) - self._base).astype(np.float32)
        _enter(
            self._points,
            seen_from,
            _ALONG,
            _SIGN,
            resolution,
            self._place,
            self._disparity,
            flat,
        )
        around = np.stack([farthest_around(face) for face in nearest]).reshape(-1)
        new = _test(self._place, self._disparity, self._reach, flat, around, self.seen)
        return float(new) / len(flat)


@njit(cache=True)
def _enter(
    points: Any,
    eye: Any,
    along: Any,
    sign: Any,
    resolution: int,
    place: Any,
    disparity: Any,
    nearest: Any,
) -> None:
    """Find each point's texel in the six maps, and its disparity; keep the greatest of a texel."""
    one, half = np.float32(1.0), np.float32(0.5 * resolution)
    q = np.empty(3, np.float32)
    for i in range(len(points)):
        q[0], q[1], q[2] = points[i, 0] - eye[0], points[i, 1] - eye[1], points[i, 2] - eye[2]
        axis = 1 if abs(q[1]) > abs(q[0]) else 0
        if abs(q[2]) > abs(q[axis]):
            axis = 2
        k = 2 * axis + (1 if q[axis] < 0.0 else 0)
        d = one / abs(q[axis])
        column = min(int((sign[k, 0] * q[along[k, 0]] * d + one) * half), resolution - 1)
        row = min(int((sign[k, 1] * q[along[k, 1]] * d + one) * half), resolution - 1)
        place[i] = (k * resolution + row) * resolution + column
        disparity[i] = d
        nearest[place[i]] = max(nearest[place[i]], d)


@njit(cache=True)
def _test(place: Any, disparity: Any, reach: Any, nearest: Any, around: Any, seen: Any) -> int:
    """Mark the points before which nothing lies; how many texels first show one of them."""
    new = 0
    for i in range(len(place)):
        if not seen[i] and around[place[i]] <= disparity[i] * reach[i]:
            seen[i] = True
            if nearest[place[i]] == disparity[i]:
                new += 1
    return new
