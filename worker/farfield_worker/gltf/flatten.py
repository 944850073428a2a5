"""Quads as plain triangles in space, split until an ordinary viewer shows their pictures right.

A reader of walks draws corners (forward + u right + v down + d e, d), over which texture
coordinates are linear. An ordinary viewer divides first: it has the points
P = e + (forward + u right + v down) / d and interpolates linearly between those. Between two
corners L texels apart whose disparities have the ratio r, its picture is then off by at most

    L (sqrt r - 1) / (sqrt r + 1)     texels, at the point that divides P0 P1 as 1 : sqrt r

so polygons are halved along their longer side until that is a quarter of a texel, or until they lie
within one texel. Where one half is split further than its neighbour, the neighbour takes in the
corners on the common edge, so no crack opens.

Nothing lies at infinity either. Beyond 2 R h, R texels across a face and h half the cell, eyes of
the cell see nothing move by more than a quarter of a texel. Disparities d below d0 = 1 / (2 R h)
become (d0 + d) / 2: finite, in the same order, and still a plane.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from farfield_core.faces import directions
from numpy.typing import NDArray

from farfield_worker.slanted.clip import clip_half_plane

Floats = NDArray[np.float64]

#: error allowed, texels
ERROR = 0.25
#: corners closer than this, texels, are one
SAME = 1e-6


class Flat(NamedTuple):
    """Triangles of one quad.

    Attributes:
        points: (n, 3) float, relative to the centre that eyes are relative to.
        texels: (n, 2) float, x, y on the face.
        triangles: (m, 3) int.
    """

    points: Floats
    texels: Floats
    triangles: NDArray[np.int64]


def flatten(
    face: int, eye: Floats, polygon: Floats, line: Floats, resolution: int, least: float
) -> Flat:
    """Triangles of a convex `polygon` (k, 2), texels of `face` of `eye` (3,).

    Its disparity at texel (x, y) is `line` (3,) . (x, y, 1); `least` is d0 above.
    """
    at_least = np.array([0.0, 0.0, least])
    points, texels, triangles = [np.zeros((0, 3))], [np.zeros((0, 2))], []
    count = 0
    for part, plane in (
        (clip_half_plane(polygon, line - at_least), line),
        (clip_half_plane(polygon, at_least - line), (line + at_least) / 2),
    ):
        if len(part) < 3:
            continue
        for piece in _without_gaps(_split(part, plane)):
            u, v = (2.0 * piece / resolution - 1.0).T
            d = piece @ plane[:2] + plane[2]
            points.append(eye + directions(face, u, v) / d[:, None])
            texels.append(piece)
            step = np.arange(1, len(piece) - 1)
            triangles.append(count + np.stack([0 * step, step, step + 1], axis=1))
            count += len(piece)
    return Flat(
        np.concatenate(points),
        np.concatenate(texels),
        np.concatenate([np.zeros((0, 3), np.int64), *triangles]),
    )


def _split(polygon: Floats, line: Floats) -> list[Floats]:
    """Convex parts of `polygon` (k, 2), each small enough or within one texel."""
    done, waiting = [], [polygon]
    while waiting:
        part = waiting.pop()
        low, high = part.min(axis=0), part.max(axis=0)
        size = high - low
        d = part @ line[:2] + line[2]
        root = np.sqrt(d.max() / d.min())
        if size.max() <= 1.0 or np.hypot(*size) * (root - 1) / (root + 1) <= ERROR:
            done.append(part)
            continue
        axis = int(size[1] > size[0])
        cut = np.zeros(3)
        cut[axis], cut[2] = 1.0, -(low[axis] + high[axis]) / 2
        halves = (clip_half_plane(part, cut), clip_half_plane(part, -cut))
        waiting += [half for half in halves if len(half) >= 3]
    return done


def _without_gaps(parts: list[Floats]) -> list[Floats]:
    """The same parts, each with the corners of others that lie on its edges; first one inside."""
    if len(parts) == 1:
        return parts
    lines: list[dict[int, list[float]]] = [defaultdict(list), defaultdict(list)]
    for corner in np.concatenate(parts):
        for axis in (0, 1):
            lines[axis][_key(corner[axis])].append(float(corner[1 - axis]))
    ordered = [{at: np.unique(np.round(v, 6)) for at, v in on.items()} for on in lines]
    result = []
    for part in parts:
        corners = [part.mean(axis=0)]
        for i in range(len(part)):
            a, b = part[i], part[(i + 1) % len(part)]
            corners.append(a)
            for axis in (0, 1):
                if _key(a[axis]) == _key(b[axis]):
                    corners += _between(ordered[axis][_key(a[axis])], a, b, axis)
        corners.append(part[0])
        result.append(np.array(corners))
    return result


def _key(value: Any) -> int:
    return round(float(value) / SAME)


def _between(places: Floats, a: Floats, b: Floats, axis: int) -> list[Floats]:
    """Points at `places` along the line on which `axis` is that of `a`, those from `a` to `b`."""
    start, end = a[1 - axis], b[1 - axis]
    low, high = min(start, end) + SAME, max(start, end) - SAME
    inner = places[(places > low) & (places < high)]
    found = []
    for place in inner if end > start else inner[::-1]:
        point = a.copy()
        point[1 - axis] = place
        found.append(point)
    return found
