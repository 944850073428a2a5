"""Which surfaces some eye in the view cell can see: from-region visibility by sampling.

LEMI leaves this out (its footnote 2). Hidden are surfaces behind others from everywhere in the
cell; that near geometry hides most of the far field in a street is what makes it worth while.
Sampled are depth maps of the whole scene from the cell's centre, its corners and the middles of its
faces. A point is seen by an eye if in the map's texel, or in one of the eight around, nothing is
nearer than the point by more than the tolerance within which it may be drawn. Points are tested eye
by eye, only those not yet seen, and a map is drawn only if any fall on it.

Measured in a street of the medieval town, as shares of the far field's pixels missing at random
eyes: 1.3e-2 for the texel alone, 3.1e-3 with its neighbours; then, spread by two texels
(visibility/spread.py), 3.6e-4, and 1.9e-3 without the six middles.
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
    corners = itertools.product((-1.0, 1.0), repeat=3)
    middles = [sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]
    offsets = np.array([(0.0, 0.0, 0.0), *corners, *middles])
    return np.asarray(centre + offsets * np.asarray(half_extents, np.float64))


def seen(
    points: Floats,
    slack: Floats,
    eyes: Floats,
    maps: MapSource,
    known: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Which of `points` (n, 3), scene coordinates, some of `eyes` (k, 3) can see: (n,) bool.

    A point counts as seen if nothing lies before it by more than `slack` (n,), 1/m, of disparity.
    Points in `known` (n,) count as seen already.
    """
    result = np.zeros(len(points), np.bool_) if known is None else known.copy()
    resolution = maps.resolution
    face, texel = np.empty(len(points), np.int8), np.empty(len(points), np.int32)
    disparity = np.empty(len(points))
    for eye in eyes:
        counts = np.zeros(6, np.int64)
        _project(points, result, eye, _AXES, resolution, face, texel, disparity, counts)
        for k in np.flatnonzero(counts).tolist():
            _test(face, k, texel, disparity, slack, maps.map(eye, k).disparity, result)
    return result


def triangles_seen(eyes: Floats, maps: MapSource, triangles: int) -> NDArray[np.bool_]:
    """Which of a scene's `triangles` show in some map of `eyes` (k, 3): (triangles,) bool."""
    result = np.zeros(triangles + 1, np.bool_)
    for eye in eyes:
        for face in range(6):
            result[maps.map(eye, face).triangle.reshape(-1)] = True
    return result[:-1]


@njit(cache=True)
def _project(
    points: Any,
    known: Any,
    eye: Any,
    axes: Any,
    resolution: int,
    face: Any,
    texel: Any,
    disparity: Any,
    counts: Any,
) -> None:
    """Face, texel and disparity of each point not known yet, face -1 for the others."""
    q = np.empty(3)
    for i in range(len(points)):
        face[i] = -1
        if known[i]:
            continue
        axis = 0
        for a in range(3):
            q[a] = points[i, a] - eye[a]
            if abs(q[a]) > abs(q[axis]):
                axis = a
        if q[axis] == 0.0:
            continue
        k = 2 * axis + (1 if q[axis] < 0.0 else 0)
        right = q[0] * axes[k, 0, 0] + q[1] * axes[k, 0, 1] + q[2] * axes[k, 0, 2]
        down = q[0] * axes[k, 1, 0] + q[1] * axes[k, 1, 1] + q[2] * axes[k, 1, 2]
        depth = abs(q[axis])
        column = min(int((right / depth + 1.0) * 0.5 * resolution), resolution - 1)
        row = min(int((down / depth + 1.0) * 0.5 * resolution), resolution - 1)
        face[i] = k
        texel[i] = row * resolution + column
        disparity[i] = 1.0 / depth
        counts[k] += 1


@njit(cache=True)
def _test(
    face: Any, k: int, texel: Any, disparity: Any, slack: Any, nearest: Any, known: Any
) -> None:
    """Mark the points on face k before which nothing lies in one of nine texels."""
    width = nearest.shape[1]
    for i in range(len(texel)):
        if face[i] == k:
            known[i] = _reached(
                nearest, texel[i] // width, texel[i] % width, disparity[i] + slack[i]
            )


@njit(cache=True)
def _reached(nearest: Any, row: int, column: int, disparity: float) -> bool:
    """Whether in the 3 x 3 texels around something is no nearer than `disparity`."""
    height, width = nearest.shape
    for y in range(max(row - 1, 0), min(row + 2, height)):
        for x in range(max(column - 1, 0), min(column + 2, width)):
            if nearest[y, x] <= disparity:
                return True
    return False
