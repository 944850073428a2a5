"""Which triangle is nearest at each texel of a face, rasterised by the processor.

A depth map needs neither colours nor textures, and a scene of many small triangles is mostly
hidden by a few near ones: without a GPU this is several times faster than a software GL. Clusters
(visibility/clusters.py) come nearest first. One is left out where its greatest disparity is below
the least that is drawn in each of the tiles of texels it covers (Greene, Kass, Miller 1993, with
one level and its minima kept up to date). Of the others every triangle is scan converted: in each
row of texels, from where the row's middle enters the triangle to where it leaves it. Disparity is
affine over the face, so it needs no division. A triangle that reaches behind the eye is clipped.
Where a material has holes (visibility/cutouts.py), each texel's opacity is looked up.

Sampled are texel centres, edges included, in double precision: neighbours leave no crack.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.cutouts import DITHER, dithered, opacity

#: texels across a tile
TILE = 8


class Tiles:
    """What is drawn of a map so far.

    Attributes:
        disparity: (h, w) float32, 1/m, 0 where nothing is.
        triangle: (h, w) int32, -1 where nothing is.
        floor: (th, tw) float32, least disparity in each tile.
        stale: (th, tw) bool, whether `floor` must be found again.
    """

    def __init__(self, resolution: int) -> None:
        tiles = -(-resolution // TILE)
        self.disparity: NDArray[np.float32] = np.zeros((resolution, resolution), np.float32)
        self.triangle: NDArray[np.int32] = np.full((resolution, resolution), -1, np.int32)
        self.floor: NDArray[np.float32] = np.zeros((tiles, tiles), np.float32)
        self.stale: NDArray[np.bool_] = np.zeros((tiles, tiles), np.bool_)


@njit(cache=True)
def draw_clusters(
    positions: Any,
    indices: Any,
    runs: Any,
    rects: Any,
    nearest_of: Any,
    one_sided: Any,
    cutouts: Any,
    eye: Any,
    axes: Any,
    nearest: float,
    disparity: Any,
    triangle: Any,
    floor: Any,
    stale: Any,
) -> None:
    """Draw clusters `runs` (k, 3), batch, first triangle, triangles, nearest first.

    `rects` (k, 4) and `nearest_of` (k,) are the texels that their bounds cover and the greatest
    disparity of the bounds. `one_sided` says of each batch whether back faces are dropped;
    `cutouts` are the materials' opacities, or None where all batches are opaque: numba then
    compiles a faster kernel. `eye` (3,) is relative to the scene's origin, `axes` (3, 3) are right,
    down, forward. Nothing nearer than Z = `nearest` is drawn. The last four are those of `Tiles`.
    """
    resolution = len(disparity)
    half = 0.5 * resolution
    # right, down, forward, and texture coordinates and opacity; then column, row, disparity and
    # the same times disparity
    view = np.zeros((3, 6))
    clipped = np.empty((4, 6))
    corner = np.empty((3, 6))
    slopes = np.empty((2, 4))
    for r in range(len(runs)):
        if hidden(rects[r], nearest_of[r], disparity, floor, stale):
            continue
        batch = runs[r, 0]
        drop = one_sided[batch]
        for t in range(runs[r, 1], runs[r, 1] + runs[r, 2]):
            left = right = above = below = True
            near, far = np.inf, -np.inf
            for i in range(3):
                v = indices[t, i]
                x = positions[v, 0] - eye[0]
                y = positions[v, 1] - eye[1]
                z = positions[v, 2] - eye[2]
                a = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
                b = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
                c = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
                view[i, 0], view[i, 1], view[i, 2] = a, b, c
                near, far = min(near, c), max(far, c)
                left, right = left and a < -c, right and a > c
                above, below = above and b < -c, below and b > c
            if far < nearest or left or right or above or below:
                continue
            if cutouts is not None:
                for i in range(3):
                    v = indices[t, i]
                    view[i, 3], view[i, 4] = cutouts.uvs[v, 0], cutouts.uvs[v, 1]
                    view[i, 5] = cutouts.colors[v, 3] / 65535.0
            if near >= nearest:
                for i in range(3):
                    d = 1.0 / view[i, 2]
                    corner[i, 0] = (view[i, 0] * d + 1.0) * half
                    corner[i, 1] = (view[i, 1] * d + 1.0) * half
                    corner[i, 2] = d
                    if cutouts is not None:
                        for a in range(3, 6):
                            corner[i, a] = view[i, a] * d
                _fill(corner, slopes, drop, t, batch, cutouts, disparity, triangle, stale)
                continue
            count = _clip(view, nearest, clipped)
            _project(clipped, count, half)
            for k in range(1, count - 1):
                corner[0], corner[1], corner[2] = clipped[0], clipped[k], clipped[k + 1]
                _fill(corner, slopes, drop, t, batch, cutouts, disparity, triangle, stale)


@njit(cache=True)
def _project(corners: Any, count: int, half: float) -> None:
    """Turn right, down, forward into column, row, disparity, and scale the rest by disparity."""
    for k in range(count):
        d = 1.0 / corners[k, 2]
        corners[k, 0] = (corners[k, 0] * d + 1.0) * half
        corners[k, 1] = (corners[k, 1] * d + 1.0) * half
        corners[k, 2] = d
        for a in range(3, 6):
            corners[k, a] *= d


@njit(cache=True)
def hidden(rect: Any, nearest: float, disparity: Any, floor: Any, stale: Any) -> bool:
    """Whether everything in `rect` (4,) is nearer already than disparity `nearest`."""
    for ty in range(rect[1] // TILE, (rect[3] - 1) // TILE + 1):
        for tx in range(rect[0] // TILE, (rect[2] - 1) // TILE + 1):
            if stale[ty, tx]:
                least = disparity[ty * TILE, tx * TILE]
                for y in range(ty * TILE, min(ty * TILE + TILE, len(disparity))):
                    for x in range(tx * TILE, min(tx * TILE + TILE, len(disparity))):
                        least = min(least, disparity[y, x])
                floor[ty, tx], stale[ty, tx] = least, False
            if floor[ty, tx] <= nearest:
                return False
    return True


@njit(cache=True)
def _clip(view: Any, nearest: float, out: Any) -> int:
    """Part of a triangle at Z >= `nearest` (Sutherland and Hodgman 1974); return its corners."""
    count = 0
    for i in range(3):
        j = (i + 1) % 3
        zi, zj = view[i, 2] - nearest, view[j, 2] - nearest
        if zi >= 0.0:
            out[count] = view[i]
            count += 1
        if zi * zj < 0.0:
            t = zi / (zi - zj)
            for a in range(6):
                out[count, a] = view[i, a] + t * (view[j, a] - view[i, a])
            out[count, 2] = nearest
            count += 1
    return count


@njit(cache=True)
def _fill(
    c: Any,
    slopes: Any,
    one_sided: bool,
    t: int,
    batch: int,
    cutouts: Any,
    disparity: Any,
    triangle: Any,
    stale: Any,
) -> None:
    """Draw triangle `t` with corners `c` (3, 6), see `draw_clusters`.

    `slopes` (2, 4) is scratch: change of the last four along columns and rows.
    """
    resolution = len(disparity)
    low, high = min(c[0, 1], c[1, 1], c[2, 1]), max(c[0, 1], c[1, 1], c[2, 1])
    top, bottom = np.ceil(low - 0.5), np.floor(high - 0.5)
    if bottom < top or bottom < 0.0 or top >= resolution:
        return
    low, high = min(c[0, 0], c[1, 0], c[2, 0]), max(c[0, 0], c[1, 0], c[2, 0])
    if np.floor(high - 0.5) < np.ceil(low - 0.5):
        return
    x1, y1, x2, y2 = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[2, 0] - c[0, 0], c[2, 1] - c[0, 1]
    area = x1 * y2 - x2 * y1
    # rows run down, so a front face, counter-clockwise seen from the eye, has a negative area
    if area == 0.0 or (one_sided and area > 0.0):
        return
    for a in range(1 if cutouts is None else 4):
        d1, d2 = c[1, a + 2] - c[0, a + 2], c[2, a + 2] - c[0, a + 2]
        slopes[0, a], slopes[1, a] = (d1 * y2 - d2 * y1) / area, (d2 * x1 - d1 * x2) / area
    dx, dy = slopes[0, 0], slopes[1, 0]
    least, most = min(c[0, 2], c[1, 2], c[2, 2]), max(c[0, 2], c[1, 2], c[2, 2])
    for row in range(int(max(top, 0.0)), int(min(bottom, resolution - 1.0)) + 1):
        y = row + 0.5
        left, right = _span(c, y)
        if not right >= 0.0 or left >= resolution:
            continue
        first = int(np.ceil(max(left, 0.0) - 0.5))
        last = int(np.floor(min(right, float(resolution)) - 0.5))
        base = c[0, 2] + (y - c[0, 1]) * dy + (0.5 - c[0, 0]) * dx
        drawn = False
        for column in range(first, last + 1):
            # slivers have no slope worth the name: keep to what the corners have
            d = np.float32(min(max(base + column * dx, least), most))
            if d > disparity[row, column]:
                if cutouts is not None:  # noqa: SIM102 - numba drops this branch as it stands
                    if not _drawn(c, slopes, batch, cutouts, column, row):
                        continue
                disparity[row, column] = d
                triangle[row, column] = t
                drawn = True
        if drawn:
            for tile in range(first // TILE, last // TILE + 1):
                stale[row // TILE, tile] = True


@njit(cache=True, inline="always")
def _span(c: Any, y: float) -> tuple[float, float]:
    """Where the middle `y` of a row of texels enters and leaves a triangle with corners `c`."""
    left, right = np.inf, -np.inf
    for i in range(3):
        j = (i + 1) % 3
        # always from the upper corner down: neighbours then agree about their common edge
        a, b = (i, j) if c[i, 1] < c[j, 1] else (j, i)
        if c[a, 1] <= y <= c[b, 1] and c[a, 1] < c[b, 1]:
            x = c[a, 0] + (y - c[a, 1]) / (c[b, 1] - c[a, 1]) * (c[b, 0] - c[a, 0])
            left, right = min(left, x), max(right, x)
    return left, right


@njit(cache=True, inline="always")
def _drawn(c: Any, slopes: Any, batch: int, cutouts: Any, column: int, row: int) -> bool:
    """Whether a triangle with corners `c` (3, 6) is opaque enough at a texel."""
    x, y = column + 0.5 - c[0, 0], row + 0.5 - c[0, 1]
    z = 1.0 / (c[0, 2] + x * slopes[0, 0] + y * slopes[1, 0])
    u = (c[0, 3] + x * slopes[0, 1] + y * slopes[1, 1]) * z
    v = (c[0, 4] + x * slopes[0, 2] + y * slopes[1, 2]) * z
    alpha = (c[0, 5] + x * slopes[0, 3] + y * slopes[1, 3]) * z
    texture = cutouts.texture[batch]
    if texture >= 0:
        steps = 0.0
        for k in range(2):
            du = (slopes[k, 1] - u * slopes[k, 0]) * z * cutouts.sizes[texture, 0, 0]
            dv = (slopes[k, 2] - v * slopes[k, 0]) * z * cutouts.sizes[texture, 0, 1]
            steps = max(steps, du * du + dv * dv)
        lod = 0.5 * np.log2(steps) if steps > 1.0 else 0.0
        alpha *= opacity(cutouts, texture, u, v, lod)
    if cutouts.kind[batch] == DITHER:
        drawn = dithered(alpha, column, row)
    else:
        drawn = alpha >= cutouts.cutoff[batch]
    return bool(drawn)
