"""Which triangles of which near blocks a view cell's near field holds.

A triangle belongs to it when it meets the cube; the test is exact up to rounding: Akenine-Moller,
"Fast 3D Triangle-Box Overlap Testing" (2001), thirteen separating axes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from farfield_core.scene import Block, PreparedScene
from numpy.typing import NDArray


class NearRanges(NamedTuple):
    """Triangles of one block.

    Attributes:
        block: index into the scene's blocks.
        ranges: (primitive, first triangle, triangles) triples, flat; primitives are the block's
            parts, triangles are counted inside the primitive.
    """

    block: int
    ranges: tuple[int, ...]

    @property
    def triangles(self) -> int:
        """Triangles in all ranges."""
        return sum(self.ranges[2::3])


def near_triangles(
    scene: PreparedScene, eye: NDArray[np.float64], half_width: float
) -> NDArray[np.int64]:
    """Triangles that meet the cube of max norm `half_width` around `eye` (3,), ascending: (n,)."""
    centre = np.asarray(eye, np.float64) - scene.origin
    found = [np.zeros(0, np.int64)]
    for index in touched_blocks(scene, centre, half_width).tolist():
        block = scene.info.blocks[index]
        rows = np.arange(block.first_triangle, block.first_triangle + block.triangles)
        if not _inside(block, centre, half_width):
            triangles = np.asarray(scene.triangles[rows[0] : rows[-1] + 1])
            rows = rows[cube_meets(scene.positions, triangles, centre, half_width)]
        found.append(rows)
    return np.sort(np.concatenate(found))


def near_list(scene: PreparedScene, triangles: NDArray[np.int64]) -> list[NearRanges]:
    """Ranges that hold just `triangles` (n,), ascending."""
    out = []
    for index, block in enumerate(scene.info.blocks):
        ends = (block.first_triangle, block.first_triangle + block.triangles)
        start, end = np.searchsorted(triangles, ends)
        if start == end:
            continue
        here = np.zeros(block.triangles, np.bool_)
        here[triangles[start:end] - block.first_triangle] = True
        ranges = []
        for n, part in enumerate(block.parts):
            first = part.first_triangle - block.first_triangle
            ranges += [(n, *run) for run in runs(here[first : first + part.triangles])]
        out.append(NearRanges(index, tuple(number for run in ranges for number in run)))
    return out


def touched_blocks(
    scene: PreparedScene, centre: NDArray[np.float64], half_width: float
) -> NDArray[np.int64]:
    """Blocks whose bounds meet the cube around `centre` (3,), relative to the scene's origin."""
    low = np.array([block.low for block in scene.info.blocks])
    high = np.array([block.high for block in scene.info.blocks])
    meets = (low <= centre + half_width) & (high >= centre - half_width)
    return np.flatnonzero(meets.all(axis=1))


def runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, count) of the runs of true entries."""
    places = np.flatnonzero(chosen)
    if len(places) == 0:
        return []
    breaks = np.flatnonzero(np.diff(places) > 1)
    firsts = places[np.concatenate([[0], breaks + 1])]
    lasts = places[np.concatenate([breaks, [len(places) - 1]])]
    return [(int(a), int(b - a + 1)) for a, b in zip(firsts, lasts, strict=True)]


def _inside(block: Block, centre: NDArray[np.float64], half_width: float) -> bool:
    low, high = np.array(block.low), np.array(block.high)
    return bool((low >= centre - half_width).all() and (high <= centre + half_width).all())


@numba.njit(cache=True, nogil=True)
def cube_meets(  # type: ignore[no-untyped-def]
    positions, triangles, centre, half_width
) -> Any:
    """Whether each triangle meets a cube.

    Args:
        positions: (n, 3) float32.
        triangles: (m, 3) uint32, indices into `positions`.
        centre: (3,) float64.
        half_width: float.

    Returns:
        (m,) bool.
    """
    out = np.zeros(len(triangles), np.bool_)
    p = np.empty((3, 3))
    for t in range(len(triangles)):
        for c in range(3):
            for axis in range(3):
                p[c, axis] = np.float64(positions[triangles[t, c], axis]) - centre[axis]
        out[t] = _meets(p, half_width)
    return out


@numba.njit(cache=True, nogil=True)
def _meets(p, h) -> Any:  # type: ignore[no-untyped-def]
    # the cube's three face normals
    for axis in range(3):
        if min(p[0, axis], p[1, axis], p[2, axis]) > h:
            return False
        if max(p[0, axis], p[1, axis], p[2, axis]) < -h:
            return False
    # cross products of the triangle's edges with the cube's
    for e in range(3):
        f = (e + 1) % 3
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            a, b = p[f, j] - p[e, j], p[e, i] - p[f, i]
            low, high = np.inf, -np.inf
            for c in range(3):
                s = a * p[c, i] + b * p[c, j]
                low, high = min(low, s), max(high, s)
            reach = h * (abs(a) + abs(b))
            if low > reach or high < -reach:
                return False
    # the triangle's normal
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    distance = abs(nx * p[0, 0] + ny * p[0, 1] + nz * p[0, 2])
    return distance <= h * (abs(nx) + abs(ny) + abs(nz))
