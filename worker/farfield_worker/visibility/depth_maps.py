"""Depth maps of the whole scene, near geometry included, from eyes in a view cell.

A map holds, for one face of one eye, the disparity of the nearest surface at each texel and its
triangle. Maps depend on the eye alone, not on the cell, so neighbouring cells share those
of common corners through a `MapCache`.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple, Protocol

import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.visibility.clusters import Clusters
from farfield_worker.visibility.pictures import Picture, Pictures
from farfield_worker.visibility.raster import Tiles

Floats = NDArray[np.float64]

#: nothing nearer to the eye than this, in metres, is seen
NEAREST = 0.02


class DepthMap(NamedTuple):
    """The nearest surfaces on one face of one eye.

    Attributes:
        disparity: (resolution, resolution) float32, 1/m; 0 where there is nothing.
        triangle: (resolution, resolution) int32; -1 where there is nothing.
    """

    disparity: NDArray[np.float32]
    triangle: NDArray[np.int32]


class MapSource(Protocol):
    """Whatever makes depth maps."""

    resolution: int

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        ...


class DepthMapRenderer:
    """Draws depth maps. Create it in the process that uses it, never before a fork.

    Maps are rasterised by the processor (visibility/raster.py), pictures drawn by GL.
    """

    def __init__(
        self, scene: PreparedScene, resolution: int, clusters: Clusters | None = None
    ) -> None:
        self.scene = scene
        self.resolution = resolution
        self.clusters = clusters or Clusters(scene)
        self.pictures = Pictures(scene, resolution)

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        tiles = Tiles(self.resolution)
        clusters = self.clusters.in_view(eye, face, NEAREST, self.resolution)
        self.clusters.draw(clusters, eye, face, NEAREST, tiles)
        return DepthMap(tiles.disparity, tiles.triangle)

    def picture(self, eye: Floats, face: int, triangles: NDArray[np.int32]) -> Picture:
        """Picture of `triangles` (n,), indices, alone on `face` of `eye` (3,)."""
        return self.pictures.draw(eye, face, NEAREST, self.clusters.by_batch(triangles))

    def close(self) -> None:
        """Free what the GPU holds."""
        self.pictures.close()


class MapCache:
    """Keeps the maps last used, by eye and face; eyes are equal within a millimetre."""

    def __init__(self, source: MapSource, capacity: int = 64) -> None:
        self.source = source
        self.resolution = source.resolution
        self.capacity = capacity
        self.made = 0
        self._maps: OrderedDict[tuple[int, int, int, int], DepthMap] = OrderedDict()

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        x, y, z = (round(float(c) * 1000) for c in eye)
        key = (x, y, z, face)
        found = self._maps.get(key)
        if found is None:
            found = self._maps[key] = self.source.map(eye, face)
            self.made += 1
            while len(self._maps) > self.capacity:
                self._maps.popitem(last=False)
        self._maps.move_to_end(key)
        return found
