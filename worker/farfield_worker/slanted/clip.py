"""Clip quads to where their surfaces are.

A thin sheet on a nearly edge-on plane overshoots: within half a texel past its last centre the
plane may run on for metres, a spike seen from aside. So a quad is cut where its plane leaves the
range of disparities that its triangles reach inside its texels, grown by half a texel, plus one
tolerance. Both cuts are parallel lines in (u, v), so a rectangle keeps at most six corners. The
rectangle is first grown by a twentieth of a texel, which closes hairlines between neighbours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_worker.slanted.fill import SheetTexels
from farfield_worker.slanted.grid import GROWTH
from farfield_worker.slanted.planes import TrianglePlanes
from farfield_worker.slanted.tolerance import Tolerance

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: corners closer than this, in texels, are one corner
MERGED = 1e-9


def disparity_range(
    texels: SheetTexels,
    disparity: Floats,
    seed: Ints,
    triangles: TrianglePlanes,
    tolerance: Tolerance,
    resolution: int,
) -> tuple[Floats, Floats]:
    """Range of disparity that each sheet's surfaces reach, plus one tolerance: (s,), (s,) float.

    `disparity` (n,) and `seed` (n,), row of `triangles`, are the fragments'. Sheets without texels
    get an empty range. The lower end is at least 0.
    """
    d = disparity[texels.fragment]
    row = seed[texels.fragment]
    slope = np.abs(triangles.plane[row, :2]).sum(axis=1) * (2.0 / resolution)
    slope = np.where(np.isnan(slope), np.inf, slope)
    lowest = np.minimum(np.maximum(d - slope, triangles.low[row]), d)
    highest = np.maximum(np.minimum(d + slope, triangles.high[row]), d)
    count = len(texels.rect)
    sheet = np.repeat(np.arange(count), np.diff(texels.starts))
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, sheet, lowest)
    np.maximum.at(high, sheet, highest)
    some = np.isfinite(low)
    low[some] = tolerance.interval(low[some])[0]
    high[some] = tolerance.interval(high[some])[1]
    return np.maximum(low, 0.0), high


def grown_rectangles(rects: Ints) -> Floats:
    """Corners of `rects` (n, 4), grown by GROWTH: (n, 4, 2) float, texels, in turn."""
    x0, y0 = (rects[:, :2] - GROWTH).T
    x1, y1 = (rects[:, 2:] + GROWTH).T
    return np.stack([x0, y0, x1, y0, x1, y1, x0, y1], axis=1).reshape(-1, 4, 2)


def clip_half_plane(polygon: Floats, line: Floats) -> Floats:
    """Part of a convex `polygon` (k, 2) where a x + b y + c >= 0 for `line` (3,): (m, 2) float.

    Sutherland and Hodgman (1974); m is at most k + 1, and 0 where nothing is left.
    """
    side = polygon @ line[:2] + line[2]
    out = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if side[i] >= 0:
            out.append(polygon[i])
        if (side[i] > 0 > side[j]) or (side[i] < 0 < side[j]):
            t = side[i] / (side[i] - side[j])
            out.append(polygon[i] + t * (polygon[j] - polygon[i]))
    corners = np.array(out).reshape(-1, 2)
    apart = np.abs(corners - np.roll(corners, 1, axis=0)).max(axis=1, initial=0.0) > MERGED
    return np.asarray(corners[apart])


def texel_line(plane: Floats, resolution: int) -> Floats:
    """Plane (3,) over (u, v) as an affine function of texels (x, y): (3,) float."""
    a, b, c = plane
    return np.array([2 * a / resolution, 2 * b / resolution, c - a - b])


def clip_to_range(
    polygon: Floats, plane: Floats, low: float, high: float, resolution: int
) -> Floats:
    """Part of `polygon` (k, 2), texels, where `plane` (3,) lies in [low, high]: (m, 2) float."""
    line = texel_line(plane, resolution)
    below, above = line - np.array([0, 0, low]), np.array([0, 0, high]) - line
    if (polygon @ below[:2] + below[2]).min() < 0:
        polygon = clip_half_plane(polygon, below)
    if len(polygon) and (polygon @ above[:2] + above[2]).min() < 0:
        polygon = clip_half_plane(polygon, above)
    return polygon


def untouched(
    polygons: Floats, planes: Floats, low: Floats, high: Floats, walls: Floats, resolution: int
) -> NDArray[np.bool_]:
    """Polygons (n, k, 2), texels, that need no clipping: (n,) bool.

    Their `planes` (n, 3) stay within [low, high], (n,) each, and beyond one of `walls` (m, 3).
    """

    def at_corners(over: Floats) -> Floats:
        a, b, c = 2 * over[:, :1] / resolution, 2 * over[:, 1:2] / resolution, over[:, 2:]
        return np.asarray(
            a * polygons[..., 0] + b * polygons[..., 1] + c - over[:, :2].sum(1)[:, None]
        )

    d = at_corners(planes)
    beyond = np.zeros(len(polygons), np.bool_)
    for wall in walls:
        beyond |= (d <= at_corners(wall[None])).all(axis=1)
    return np.asarray(beyond & (d.min(axis=1) >= low) & (d.max(axis=1) <= high))
