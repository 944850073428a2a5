"""Which near triangles the eyes of a view cell can see.

A triangle counts as seen if it shows in a near map, or if one of some points on it (its middle, and
others along its edges, a few texels apart) has nothing solid before it, in its map's texel or in
one of the eight around. The second test keeps what is too small or too thin for the map's texels,
and what lies just behind an edge, which an eye a little to the side may see; a triangle that turns
its back to the eye fails it unless its material is double-sided.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.near_maps import NearMap, farthest_around

Floats = NDArray[np.float64]

#: where the points along edges lie, from the middle
TOWARDS = 0.95
#: texels between points along an edge, and points along one at most
SPACING, MOST = 3.0, 8
#: share by which a surface's own depth may differ between a map and our arithmetic
ROUNDING = 1e-4

#: axes of all faces, (6, 3, 3): right, down, forward
_AXES = np.array([[f.right, f.down, f.forward] for f in FACES])


class NearTriangles:
    """Watches a cell's near triangles.

    `triangles` (n,) int, ascending, are those that meet the near field of `half_width` around
    `centre` (3,), scene coordinates.

    Attributes:
        triangles: as given.
        seen: (n,) bool.
    """

    def __init__(
        self,
        scene: PreparedScene,
        triangles: NDArray[np.int64],
        centre: Floats,
        half_width: float,
    ) -> None:
        self.triangles = triangles
        self.seen = np.zeros(len(triangles), np.bool_)
        self._centre, self._half_width = np.asarray(centre, np.float64), half_width
        corners = np.asarray(scene.positions)[np.asarray(scene.triangles)[triangles]]
        self._corners = corners + (scene.origin - self._centre)
        self._two_sided = _two_sided(scene)[triangles]
        self._row = np.full(scene.info.triangles, -1, np.int32)
        self._row[triangles] = np.arange(len(triangles), dtype=np.int32)

    def look(self, eye: Floats, maps: Sequence[NearMap]) -> float:
        """See `sampling.Watcher`."""
        before, new = self.seen.copy(), 0
        for near_map in maps:
            new += _show(near_map.triangle, self._row, before, self.seen)
        _test(
            self._corners,
            self._two_sided,
            np.asarray(eye, np.float64) - self._centre,
            self._half_width,
            np.stack([farthest_around(near_map.solid) for near_map in maps]),
            _AXES,
            self.seen,
        )
        return new / sum(near_map.triangle.size for near_map in maps)


def _two_sided(scene: PreparedScene) -> NDArray[np.bool_]:
    """Whether each triangle of the scene shows from behind too."""
    out = np.zeros(scene.info.triangles, np.bool_)
    for block in scene.info.blocks:
        for part in block.parts:
            if scene.info.batches[part.batch].double_sided:
                out[part.first_triangle : part.first_triangle + part.triangles] = True
    return out


@njit(cache=True)
def _show(triangle: Any, row: Any, before: Any, seen: Any) -> int:
    """Mark what a map shows; returns how many of its texels show what was not `before`."""
    new = 0
    for y in range(triangle.shape[0]):
        for x in range(triangle.shape[1]):
            if triangle[y, x] < 0 or row[triangle[y, x]] < 0:
                continue
            t = row[triangle[y, x]]
            new += not before[t]
            seen[t] = True
    return new


@njit(cache=True)
def _test(
    corners: Any, two_sided: Any, eye: Any, half_width: float, solid: Any, axes: Any, seen: Any
) -> None:
    """Mark triangles of which a point has nothing solid before it; all is relative to a centre."""
    resolution = solid.shape[1]
    half = 0.5 * resolution
    p, q = np.empty(3), np.empty(3)
    for t in range(len(corners)):
        if seen[t]:
            continue
        if not two_sided[t] and _turned(corners[t], eye):
            continue
        along = _points(corners[t], eye, half)
        for point in range(1 + 3 * along):
            edge, step = (point - 1) // along, ((point - 1) % along) / along
            inside = True
            for a in range(3):
                middle = (corners[t, 0, a] + corners[t, 1, a] + corners[t, 2, a]) / 3.0
                p[a] = middle
                if point > 0:
                    start, end = corners[t, edge, a], corners[t, (edge + 1) % 3, a]
                    p[a] += TOWARDS * (start + step * (end - start) - middle)
                inside = inside and abs(p[a]) <= half_width
                q[a] = p[a] - eye[a]
            if not inside:
                continue
            axis = 0
            for a in range(1, 3):
                if abs(q[a]) > abs(q[axis]):
                    axis = a
            depth = abs(q[axis])
            if depth == 0.0:
                continue
            k = 2 * axis + (1 if q[axis] < 0.0 else 0)
            right = q[0] * axes[k, 0, 0] + q[1] * axes[k, 0, 1] + q[2] * axes[k, 0, 2]
            down = q[0] * axes[k, 1, 0] + q[1] * axes[k, 1, 1] + q[2] * axes[k, 1, 2]
            column = min(int((right / depth + 1.0) * half), resolution - 1)
            row = min(int((down / depth + 1.0) * half), resolution - 1)
            if solid[k, row, column] * depth <= 1.0 + ROUNDING:
                seen[t] = True
                break


@njit(cache=True)
def _points(c: Any, eye: Any, half: float) -> int:
    """How many points along each edge are about SPACING texels apart, seen from `eye`."""
    longest, nearest = 0.0, np.inf
    for i in range(3):
        length = distance = 0.0
        for a in range(3):
            length = max(length, abs(c[(i + 1) % 3, a] - c[i, a]))
            distance = max(distance, abs(c[i, a] - eye[a]))
        longest, nearest = max(longest, length), min(nearest, distance)
    return int(min(max(np.ceil(longest * half / (max(nearest, 1e-9) * SPACING)), 1.0), MOST))


@njit(cache=True)
def _turned(c: Any, eye: Any) -> bool:
    """Whether a triangle, counter-clockwise seen from its front, turns its back to the eye."""
    ax, ay, az = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[1, 2] - c[0, 2]
    bx, by, bz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    away = nx * (c[0, 0] - eye[0]) + ny * (c[0, 1] - eye[1]) + nz * (c[0, 2] - eye[2])
    return bool(away > 0.0)
