"""Light baked into the vertex colours: the sky that walls take away, and the sun's shadows.

The city's solid bodies are drawn into a map of heights. What a vertex sees of the sky is guessed
from blurred heights around it, its sun from a walk over the map towards the sun. Farfield's light
model knows no shadows: the factor stored here is shadowed light over unshadowed light, for the
constants that the model had when the city was drawn, so that the city's content never changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.land import EXTENT

Floats = NDArray[np.float64]
Map = NDArray[np.float32]

#: metres of one map cell
CELL = 0.5
_SIZE = int(2 * EXTENT / CELL)
_SUN = (0.4851, 0.7276, 0.4851)
_SUN_LIGHT = (0.92, 0.84, 0.70)
_AMBIENT = (0.10, 0.11, 0.13)
_UP = (0.26, 0.32, 0.42)
_DOWN = (0.16, 0.13, 0.10)
#: distances along the ray to the sun that are looked at, metres
_STEPS = (0.7, 1.5, 2.5, 3.7, 5.2, 7.0, 9.5, 12.5, 16.5, 22.0, 30.0, 40.0, 52.0)


class HeightMap:
    """Heights of solid bodies and two blurs of them."""

    def __init__(self, ground: Map, solids: Floats) -> None:
        """Draw `solids` (n, 5: x0, z0, x1, z1, top) over `ground` (size, size), rows along z."""
        heights = ground.copy()
        order = np.argsort(solids[:, 4], kind="stable")
        spans = np.rint((solids[order][:, :4] + EXTENT) / CELL).astype(np.int64)
        spans = np.clip(spans, 0, _SIZE)
        for (x0, z0, x1, z1), top in zip(spans.tolist(), solids[order, 4].tolist(), strict=True):
            heights[z0:z1, x0:x1] = top  # lowest first, so the highest stays
        self.low = np.ascontiguousarray(ground[::2, ::2])
        self.heights = heights
        metres = heights[::2, ::2]
        self.near = _blur(metres, 2)
        self.wide = _blur(metres, 6)

    def cells(self, x: Floats | Map, z: Floats | Map) -> NDArray[np.int64]:
        """Flat map indices of points."""
        i = np.clip((x + EXTENT) * (1 / CELL), 0, _SIZE - 1).astype(np.int64)
        j = np.clip((z + EXTENT) * (1 / CELL), 0, _SIZE - 1).astype(np.int64)
        return np.asarray(j * _SIZE + i)

    def metres(self, x: Floats | Map, z: Floats | Map) -> NDArray[np.int64]:
        """Flat indices of points in the blurred maps, which have cells of one metre."""
        i = np.clip(x + EXTENT, 0, 2 * EXTENT - 1).astype(np.int64)
        j = np.clip(z + EXTENT, 0, 2 * EXTENT - 1).astype(np.int64)
        return np.asarray(j * int(2 * EXTENT) + i)

    def factors(self, positions: Floats, normals: Floats) -> NDArray[np.float32]:
        """Shadowed over unshadowed light, (n, 3) float in (0, 1]."""
        x, y, z = (positions[:, k].astype(np.float32) for k in range(3))
        nx, ny, nz = (normals[:, k].astype(np.float32) for k in range(3))
        f = np.float32
        at = self.metres(x + nx * f(0.8), z + nz * f(0.8))
        near = np.clip((self.near.ravel()[at] - y) * f(0.30), 0, 1)
        wide = np.clip((self.wide.ravel()[at] - y) * f(0.16), 0, 1)
        above = np.clip(y - self.low.ravel()[at], 0, 3)
        foot = (f(1) - above * f(1 / 3)) ** 2 * (f(1) - np.abs(ny))
        sky = f(1) - f(0.38) * near - f(0.28) * wide
        sky = sky * (f(1) - f(0.30) * foot)
        lambert = np.maximum(nx * f(_SUN[0]) + ny * f(_SUN[1]) + nz * f(_SUN[2]), 0)
        sun = self._sun(x + nx * f(0.6), y + ny * f(0.3), z + nz * f(0.6), lambert)
        sun = sun * (f(1) - f(0.18) * foot)
        out = np.empty((len(x), 3), np.float32)
        for c in range(3):
            half = f(0.5) + f(0.5) * ny
            dome = f(_AMBIENT[c]) + f(_DOWN[c]) * (f(1) - half) + f(_UP[c]) * half
            direct = f(_SUN_LIGHT[c]) * lambert
            out[:, c] = (dome * sky + direct * sun) / (dome + direct)
        return out

    def _sun(self, x: Map, y: Map, z: Map, lambert: Map) -> Map:
        """How much of the sun each point sees, (n,) float in [0, 1]."""
        seen = np.ones(len(x), np.float32)
        lit = np.flatnonzero(lambert > 0.02)
        px, py, pz = x[lit], y[lit], z[lit]
        flat = self.heights.ravel()
        hidden = np.zeros(len(lit), np.float32)
        for t in _STEPS:
            at = self.cells(px + np.float32(_SUN[0] * t), pz + np.float32(_SUN[2] * t))
            over = (flat[at] - py - np.float32(_SUN[1] * t)) * np.float32(1 / (0.25 + 0.12 * t))
            np.maximum(hidden, over, out=hidden)
        seen[lit] = 1 - np.clip(hidden, 0, 1)
        return seen


def _blur(heights: Map, radius: int) -> Map:
    """Mean over squares of 2 radius + 1 cells."""
    out = heights.astype(np.float64)
    for axis in (0, 1):
        padded = np.pad(
            out, [(radius + 1, radius) if a == axis else (0, 0) for a in (0, 1)], "edge"
        )
        total = np.cumsum(padded, axis=axis)
        high = np.take(total, np.arange(2 * radius + 1, total.shape[axis]), axis=axis)
        low = np.take(total, np.arange(0, total.shape[axis] - 2 * radius - 1), axis=axis)
        out = (high - low) / (2 * radius + 1)
    return out.astype(np.float32)
