"""Whether some triangles of a scene may matter to what a view cell's bake keeps.

They are drawn from the cell's visibility eyes (visibility/sampling.py) against the depth of the
whole scene. Where one of them shows, or is hidden by less than a bake may overlook, it matters. A
bake sees through what is nearer by its tolerance, looks at neighbouring texels of maps that may be
half as fine, and follows what it sees a few texels further: all within REACH texels. It may hold
that foliage and glass hide nothing, so here they don't. A triangle that slips between texel centres
counts as covering all texels that its bounds touch.

Compare Greene, Kass, Miller, "Hierarchical Z-buffer visibility" (1993): a thing is hidden if, all
over its bounds, something nearer was drawn.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from farfield_core import placement
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.clusters import Clusters
from farfield_worker.visibility.depth_maps import NEAREST
from farfield_worker.visibility.from_region import cell_eyes
from farfield_worker.visibility.near_maps import farthest_around
from farfield_worker.visibility.raster import Tiles
from farfield_worker.visibility.sampling import EFFORTS, more_eyes

Floats = NDArray[np.float64]
Disparities = NDArray[np.float32]

#: texels around one that shows to which a bake may look or go on
REACH = 8
#: triangles whose bounds are at most so many texels wide and high cover them all
_SMALL = 6
#: layers apart that never hide each other, one more than in cell/layered.py
_APART = 3


def slack(settings: BakeSettings) -> float:
    """Disparity, 1/m, by which something may lie before a surface and a bake still keeps it.

    Two surfaces that far apart are more than `_APART` layers apart, or twice as many tolerances.
    """
    found = placement.metrics(
        settings.half_extents, settings.parallax, settings.resolution, settings.gap_texels
    )
    steps = [
        (max(2 * m.ln_k, m.ln_texel if math.isfinite(m.ln_texel) else 0.0), m.h) for m in found
    ]
    return _APART * max(step / h for step, h in steps)


def eyes_of(centre: Floats, settings: BakeSettings) -> Floats:
    """All eyes from which a bake of the cell around `centre` (3,) may look, (n, 3)."""
    assert settings.visibility != "off"
    most = EFFORTS[settings.visibility].most
    half = np.asarray(settings.half_extents)
    return np.concatenate([cell_eyes(centre, half), more_eyes(centre, half, most)])[:most]


class Shows:
    """Tells whether `triangles` (n,), ascending indices of a scene's, show."""

    def __init__(self, scene: PreparedScene, triangles: NDArray[np.int64]) -> None:
        clusters = Clusters(scene)
        self._some = clusters.of(triangles)
        self._solid = clusters.opaque()

    def from_eyes(self, eyes: Floats, resolution: int, nearer: float) -> bool:
        """Whether any shows in a map of `resolution` texels of one of `eyes` (n, 3).

        What lies before a triangle by less than the disparity `nearer` does not hide it.
        """
        return any(self._from(eye, face, resolution, nearer) for eye in eyes for face in range(6))

    def _from(self, eye: Floats, face: int, resolution: int, nearer: float) -> bool:
        view = self._some.in_view(eye, face, NEAREST, resolution)
        if len(view.cluster) == 0:
            return False
        mine = Tiles(resolution)
        self._some.draw(view, eye, face, NEAREST, mine, holes=False)
        _cover(view.rect, view.disparity, _SMALL, mine.disparity)
        rows, columns = np.nonzero(mine.disparity)
        if len(rows) == 0:
            return False
        y0, x0 = max(rows.min() - REACH, 0), max(columns.min() - REACH, 0)
        y1, x1 = rows.max() + REACH + 1, columns.max() + REACH + 1
        around = self._solid.in_view(eye, face, NEAREST, resolution)
        left, top, right, bottom = around.rect.T
        behind = (left < x1) & (right > x0) & (top < y1) & (bottom > y0)
        depth = Tiles(resolution)
        self._solid.draw(around.take(behind), eye, face, NEAREST, depth)
        farthest = depth.disparity[y0:y1, x0:x1]
        for _ in range(REACH):
            farthest = farthest_around(farthest)
        drawn = mine.disparity[y0:y1, x0:x1]
        return bool(((drawn > 0) & (farthest <= drawn + nearer)).any())


@njit(cache=True)
def _cover(rects: Any, disparity: Any, largest: int, into: Any) -> None:
    """Enter small bounds: rects (n, 4) as of `InView`, their greatest disparity (n,)."""
    for r in range(len(rects)):
        x0, y0, x1, y1 = rects[r]
        if x1 - x0 > largest or y1 - y0 > largest:
            continue
        for y in range(y0, y1):
            for x in range(x0, x1):
                into[y, x] = max(into[y, x], disparity[r])
