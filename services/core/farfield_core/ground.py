"""What lies under and over a point: the surfaces of a prepared scene along vertical lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_core.corridor import Corridor, Floats, Ground
from farfield_core.scene import Block, PreparedScene

Ints = NDArray[np.int64]

#: highest step that a walker takes, as a share of the eye's height
STEP = 0.2
#: surfaces steeper than this are walls, not ground: cosine of 60 degrees
UPRIGHT = 0.5
#: (triangle, point) pairs looked at together
_BATCH = 1 << 21


class Surfaces(NamedTuple):
    """Where vertical lines meet surfaces, sorted by (line, y).

    Attributes:
        line: (n,) int64, which line.
        y: (n,) float, height, scene coordinates.
        up: (n,) float, cosine of the angle between the surface's normal and up; negative where it
            faces down.
    """

    line: Ints
    y: Floats
    up: Floats


def ground_under(scene: PreparedScene, corridor: Corridor) -> Ground:
    """What a corridor through `scene` follows."""
    return ground_of(scene, STEP * corridor.eye_height)


def ground_of(scene: PreparedScene, step: float = 0.0) -> Ground:
    """The walkable surface of `scene` that lies nearest to a hinted height, as `corridor.cut` asks.

    Walkable is what is less than 60 degrees steep, whichever way it faces. What lies under another
    such surface by no more than `step`, scene units, is buried, as a floor is under a stair or a
    carpet: then that one is taken.
    """

    def ground(x: Floats, z: Floats, hint: Floats) -> Floats:
        hits = surfaces(scene, x, z)
        flat = np.abs(hits.up) > UPRIGHT
        line, y = hits.line[flat], hits.y[flat]
        y = _unburied(line, y, step)
        order = np.lexsort((np.abs(y - hint[line]), line))
        line, y = line[order], y[order]
        first = np.ones(len(line), bool)
        first[1:] = line[1:] != line[:-1]
        heights = np.full(len(x), np.nan)
        heights[line[first]] = y[first]
        return heights

    return ground


def _unburied(line: Ints, y: Floats, step: float) -> Floats:
    """Heights (n,) of the topmost surfaces that are reached in steps up from each, by line."""
    top = y.copy()
    for n in range(len(y) - 2, -1, -1):
        if line[n] == line[n + 1] and y[n + 1] - y[n] <= step:
            top[n] = top[n + 1]
    return top


def surfaces(scene: PreparedScene, x: Floats, z: Floats) -> Surfaces:
    """All surfaces that the vertical lines through (x (n,), z (n,)), scene coordinates, meet."""
    ox, oy, oz = scene.origin
    x, z = x - ox, z - oz
    order = np.argsort(x, kind="stable")
    found: list[tuple[Ints, Floats, Floats]] = []
    for block in scene.info.blocks:
        low = np.searchsorted(x[order], block.low[0], side="left")
        high = np.searchsorted(x[order], block.high[0], side="right")
        lines = order[low:high]
        lines = lines[(z[lines] >= block.low[2]) & (z[lines] <= block.high[2])]
        if len(lines):
            found += _block_hits(scene, block, x[lines], z[lines], lines)
    line = np.concatenate([hit[0] for hit in found] or [np.zeros(0, np.int64)])
    y = np.concatenate([hit[1] for hit in found] or [np.zeros(0)]) + oy
    up = np.concatenate([hit[2] for hit in found] or [np.zeros(0)])
    by_line = np.lexsort((y, line))
    return Surfaces(line[by_line], y[by_line], up[by_line])


def _block_hits(
    scene: PreparedScene, block: Block, x: Floats, z: Floats, lines: Ints
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Hits on one block of lines sorted by x, all relative to the scene's origin."""
    span = slice(block.first_triangle, block.first_triangle + block.triangles)
    corners = np.asarray(scene.positions[scene.triangles[span]], np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    first = np.searchsorted(x, low[:, 0], side="left")
    count = np.searchsorted(x, high[:, 0], side="right") - first
    over = (count > 0) & (high[:, 2] >= z.min()) & (low[:, 2] <= z.max())
    corners, first, count, low, high = (a[over] for a in (corners, first, count, low, high))
    batch = (np.cumsum(count) - count) // _BATCH
    for run in np.split(np.arange(len(count)), np.flatnonzero(np.diff(batch)) + 1):
        tri = np.repeat(run, count[run])
        nth = np.arange(len(tri)) - np.repeat(np.cumsum(count[run]) - count[run], count[run])
        at = first[tri] + nth
        near = (z[at] >= low[tri, 2]) & (z[at] <= high[tri, 2])
        tri, at = tri[near], at[near]
        a = corners[tri, 0]
        ab, ac = corners[tri, 1] - a, corners[tri, 2] - a
        px, pz = x[at] - a[:, 0], z[at] - a[:, 2]
        # barycentric coordinates in the xz plane; triangles seen edge-on from above hit nothing
        area = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            v = (px * ac[:, 2] - pz * ac[:, 0]) / area
            w = (pz * ab[:, 0] - px * ab[:, 2]) / area
            hit = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1 + 1e-9)
        normal = np.cross(ab[hit], ac[hit])
        up = normal[:, 1] / np.linalg.norm(normal, axis=1)
        y = a[hit, 1] + v[hit] * ab[hit, 1] + w[hit] * ac[hit, 1]
        yield lines[at[hit]], y, up
