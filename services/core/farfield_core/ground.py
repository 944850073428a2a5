"""The ground under a walker: the height of a prepared scene's surfaces along vertical lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_core.corridor import Floats, Ground
from farfield_core.scene import Block, PreparedScene

#: slopes steeper than this are walls, not ground: cosine of 60 degrees
_UPRIGHT = 0.5
#: (point, triangle) pairs looked at together
_BATCH = 1 << 22


def ground_of(scene: PreparedScene) -> Ground:
    """The walkable surface of `scene` that lies nearest to a hinted height, as `corridor.cut` asks.

    Walkable is what is less than 60 degrees steep, whichever way it faces.
    """

    def ground(x: Floats, z: Floats, hint: Floats) -> Floats:
        ox, oy, oz = scene.origin
        heights = nearest_heights(scene, np.stack([x - ox, hint - oy, z - oz], axis=1))
        return np.asarray(heights + oy, np.float64)

    return ground


def nearest_heights(scene: PreparedScene, points: Floats) -> Floats:
    """Height of the walkable surface nearest above or below each of `points`.

    `points` (n, 3) float and the heights (n,) float are relative to the scene's origin; NaN where
    there is no surface.
    """
    best = np.full(len(points), np.nan)
    order = np.argsort(points[:, 0], kind="stable")
    xs = points[order, 0]
    for block in scene.info.blocks:
        first = np.searchsorted(xs, block.low[0], side="left")
        last = np.searchsorted(xs, block.high[0], side="right")
        rows = order[first:last]
        z = points[rows, 2]
        rows = rows[(z >= block.low[2]) & (z <= block.high[2])]
        if len(rows):
            _lower_onto(scene, block, points, rows, best)
    return best


def _lower_onto(
    scene: PreparedScene, block: Block, points: Floats, rows: NDArray[np.int64], best: Floats
) -> None:
    """Let points `rows` fall on one block's triangles, updating `best` where that is nearer."""
    span = slice(block.first_triangle, block.first_triangle + block.triangles)
    corners = np.asarray(scene.positions[scene.triangles[span]], np.float64)
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    flat = np.abs(normal[:, 1]) > _UPRIGHT * np.linalg.norm(normal, axis=1)
    a, ab, ac, normal = a[flat], ab[flat], ac[flat], normal[flat]
    low = corners[flat].min(axis=1)
    high = corners[flat].max(axis=1)
    if len(a) == 0:
        return
    step = max(1, _BATCH // len(a))
    for first in range(0, len(rows), step):
        some = rows[first : first + step]
        x, z = points[some, 0, None], points[some, 2, None]
        inside = (low[:, 0] <= x) & (x <= high[:, 0]) & (low[:, 2] <= z) & (z <= high[:, 2])
        point, tri = np.nonzero(inside)
        px, pz = points[some[point], 0] - a[tri, 0], points[some[point], 2] - a[tri, 2]
        # barycentric coordinates in the xz plane
        area = ab[tri, 0] * ac[tri, 2] - ab[tri, 2] * ac[tri, 0]
        v = (px * ac[tri, 2] - pz * ac[tri, 0]) / area
        w = (pz * ab[tri, 0] - px * ab[tri, 2]) / area
        hit = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1 + 1e-9)
        if not hit.any():
            continue
        point, tri, v, w = point[hit], tri[hit], v[hit], w[hit]
        y = a[tri, 1] + v * ab[tri, 1] + w * ac[tri, 1]
        target = some[point]
        away = np.abs(y - points[target, 1])
        nearest = np.lexsort((away, target))
        nearest = nearest[np.concatenate(([True], np.diff(target[nearest]) != 0))]
        target, y, away = target[nearest], y[nearest], away[nearest]
        closer = ~(np.abs(best[target] - points[target, 1]) <= away)
        best[target[closer]] = y[closer]
