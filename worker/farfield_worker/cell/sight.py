"""What the eyes of a cell can see of its layers (`farfield_worker.visibility`).

The paper leaves out what nearer layers hide. In a street it is the near field that hides most, so
maps of the whole scene are asked, drawn from the cell's centre and corners. Maps of half a face's
texels do, for what is seen is spread along its surface.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import Walk
from numpy.typing import NDArray

from farfield_worker.render.interface import FaceTexels
from farfield_worker.slanted.quads import texel_points
from farfield_worker.slanted.tolerance import Tolerance
from farfield_worker.visibility.depth_maps import DepthMapRenderer, MapCache
from farfield_worker.visibility.from_region import cell_eyes, seen
from farfield_worker.visibility.spread import spread

#: texels of a face, along an edge, to one of a map
COARSE = 2
#: the cell's centre and corners
EYES = slice(0, 9)
#: texels by which what is seen is taken further along its surface
SPREAD = 2
#: maps kept: those of a cell and its neighbour
_CACHE = 108


class Sight:
    """Finds what the eyes of a cell can see. Create it in the process that uses it."""

    def __init__(self, scene: PreparedScene, walk: Walk, settings: BakeSettings) -> None:
        self._resolution = walk.resolution
        self._half = np.array(walk.grid.size) / 2
        self._near, self._alpha = walk.near_field, settings.parallax
        self._renderer = DepthMapRenderer(scene, -(-walk.resolution // COARSE))
        self._maps = MapCache(self._renderer, _CACHE)

    def seen(
        self, centre: NDArray[np.float64], faces: Mapping[int, FaceTexels]
    ) -> dict[int, NDArray[np.bool_]]:
        """Which texels of each face of the cell around `centre` (3,) are seen: (n,) bool."""
        if not faces:
            return {}
        bounds = {
            face: Tolerance.of(face, np.zeros(3), self._half, self._alpha, self._near, 1.0)
            for face in faces
        }
        disparities = {face: 1 / t.depth.astype(np.float64) for face, t in faces.items()}
        points, slack = [], []
        for face, texels in faces.items():
            d = disparities[face]
            points.append(centre + texel_points(face, texels.texel, d, self._resolution))
            slack.append(bounds[face].interval(d)[1] - d)
        eyes = cell_eyes(centre, self._half)[EYES]
        known = seen(np.concatenate(points), np.concatenate(slack), eyes, self._maps)
        ends = np.cumsum([len(texels.texel) for texels in faces.values()])
        return {
            face: spread(
                faces[face].texel, disparities[face], mask, bounds[face], self._resolution, SPREAD
            )
            for face, mask in zip(faces, np.split(known, ends[:-1]), strict=True)
        }

    def close(self) -> None:
        """Free what the GPU holds."""
        self._renderer.close()
