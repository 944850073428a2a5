"""Which surfaces some eye in the view cell can see: from-region visibility by sampling.

LEMI leaves this out (its footnote 2). Hidden are surfaces behind others from everywhere in the
cell; that near geometry hides most of the far field in a street is what makes it worth while.
Sampled are depth maps of the whole scene from the cell's centre, its corners and the middles of its
faces (Wonka, Wimmer, Schmalstieg 2000 shrink occluders to make sampling safe; measured here, the
15 eyes are enough and further ones find next to nothing). A point is seen by an eye if nothing in
the map's texel is nearer than the point by more than the tolerance within which it may be drawn.
Points are tested eye by eye, only those not yet seen, and a map is drawn only if any fall on it.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from farfield_core.faces import FACES
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.depth_maps import MapSource

Floats = NDArray[np.float64]

#: axes of all faces, (6, 3, 3): right, down, forward
_AXES = np.array([[f.right, f.down, f.forward] for f in FACES])


def cell_eyes(centre: Floats, half_extents: Floats) -> Floats:
    """Eyes to sample a cell from, most telling first: (15, 3) float.

    The centre, the eight corners, the middles of the six faces.
    """
    corners = [c for c in itertools.product((-1.0, 1.0), repeat=3)]
    middles = [sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]
    offsets = np.array([(0.0, 0.0, 0.0), *corners, *middles])
    return np.asarray(centre + offsets * np.asarray(half_extents, np.float64))


def seen(
    points: Floats, slack: Floats, eyes: Floats, maps: MapSource, known: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Which of `points` (n, 3), scene coordinates, some of `eyes` (k, 3) can see: (n,) bool.

    A point counts as seen if nothing lies before it by more than `slack` (n,), 1/m, of disparity.
    Points in `known` (n,) count as seen already.
    """
    result = np.zeros(len(points), np.bool_) if known is None else known.copy()
    for eye in eyes:
        for face in range(6):
            texel = np.empty(len(points), np.int32)
            disparity = np.empty(len(points))
            resolution = maps.resolution
            if _project(points, result, eye, _AXES[face], resolution, texel, disparity):
                nearest = farthest_around(maps.map(eye, face).disparity).reshape(-1)
                _test(texel, disparity, slack, nearest, result)
    return result


def farthest_around(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """Least disparity in the 3 x 3 texels around each of a map (h, w): (h, w) float32."""
    grown = np.pad(disparity, 1, mode="edge")
    rows = np.minimum(np.minimum(grown[:-2], grown[1:-1]), grown[2:])
    return np.minimum(np.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])


def triangles_seen(eyes: Floats, maps: MapSource, triangles: int) -> NDArray[np.bool_]:
    """Which of a scene's `triangles` show in some map of `eyes` (k, 3): (triangles,) bool."""
    result = np.zeros(triangles + 1, np.bool_)
    for eye in eyes:
        for face in range(6):
            result[maps.map(eye, face).triangle.reshape(-1)] = True
    return result[:-1]


@njit(cache=True)
def _project(
    points: Any, known: Any, eye: Any, axes: Any, resolution: int, texel: Any, disparity: Any
) -> int:
    """Texel and disparity of each point on a face, texel -1 where it is not on it or known."""
    found = 0
    for i in range(len(points)):
        texel[i] = -1
        if known[i]:
            continue
        x, y, z = points[i, 0] - eye[0], points[i, 1] - eye[1], points[i, 2] - eye[2]
        depth = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
        right = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        down = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
        if depth <= 0.0 or abs(right) > depth or abs(down) > depth:
            continue
        column = min(int((right / depth + 1.0) * 0.5 * resolution), resolution - 1)
        row = min(int((down / depth + 1.0) * 0.5 * resolution), resolution - 1)
        texel[i] = row * resolution + column
        disparity[i] = 1.0 / depth
        found += 1
    return found


@njit(cache=True)
def _test(texel: Any, disparity: Any, slack: Any, nearest: Any, known: Any) -> None:
    """Mark the points before which nothing lies."""
    for i in range(len(texel)):
        if texel[i] >= 0 and nearest[texel[i]] <= disparity[i] + slack[i]:
            known[i] = True
