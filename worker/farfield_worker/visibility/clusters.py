"""Which triangles to draw on a face: culling by clusters, then one by one.

Runs of 128 triangles, neighbours along the prepared scene's space-filling curve, have bounds of
their own. A cluster is dropped where its bounds lie outside the face, or behind what has been drawn
already (visibility/raster.py). Of the rest, triangles are dropped that lie outside the face, face
away, or slip between texel centres. All tests are conservative: what is dropped draws nothing.
"""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.cutouts import OPAQUE, Cutouts
from farfield_worker.visibility.raster import Tiles, draw_clusters

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: triangles in a cluster
SIZE = 128
#: texels by which the rasteriser's idea of a triangle may differ from ours
SNAP = 1.0 / 32.0


class InView(NamedTuple):
    """Clusters that may show on a face, nearest first.

    Attributes:
        cluster: (k,) int32.
        triangles: (k,) int32, how many each has.
        rect: (k, 4) int32, texels its bounds cover: first column, row, end column, row.
        disparity: (k,) float32, greatest disparity of its bounds.
    """

    cluster: Ints
    triangles: Ints
    rect: Ints
    disparity: NDArray[np.float32]

    def take(self, which: NDArray[Any] | slice) -> InView:
        """Clusters at indices or a mask or slice `which`."""
        return InView(
            self.cluster[which], self.triangles[which], self.rect[which], self.disparity[which]
        )


class ByBatch(NamedTuple):
    """Triangles, those of one batch after another.

    Attributes:
        vertices: (n, 3) uint32, indices of their corners.
        triangles: (n,) int32, their indices in the scene.
        starts: (batches + 1,) int32, where each batch's run starts.
    """

    vertices: NDArray[np.uint32]
    triangles: Ints
    starts: Ints


class Clusters:
    """The clusters of a prepared scene."""

    def __init__(self, scene: PreparedScene) -> None:
        self._positions = np.asarray(scene.positions)
        self._indices = np.asarray(scene.triangles)
        self._origin = scene.origin
        self._double_sided = np.array([b.double_sided for b in scene.info.batches], np.bool_)
        self._cutouts = Cutouts.of(scene)
        self._batches = len(scene.info.batches)
        runs = [
            (part.batch, first, min(SIZE, part.first_triangle + part.triangles - first))
            for block in scene.info.blocks
            for part in block.parts
            for first in range(part.first_triangle, part.first_triangle + part.triangles, SIZE)
        ]
        #: (n, 3) int64: batch, first triangle, triangles
        self.runs = np.array(runs, np.int64).reshape(-1, 3)
        self._bounds = np.empty((len(runs), 2, 3))
        _measure(self._positions, self._indices, self.runs, self._bounds)

    def in_view(self, eye: Floats, face: int, nearest: float, resolution: int) -> InView:
        """Clusters that may show on `face` of `eye` (3,) beyond Z = `nearest`."""
        n = len(self.runs)
        rect, disparity = np.empty((n, 4), np.int32), np.empty(n, np.float32)
        eye = np.asarray(eye, np.float64) - self._origin
        _project(self._bounds, eye, _axes(face), nearest, resolution, rect, disparity)
        shown = np.flatnonzero(disparity > 0)
        order = shown[np.argsort(-disparity[shown], kind="stable")].astype(np.int32)
        triangles = self.runs[order, 2].astype(np.int32)
        return InView(order, triangles, rect[order], disparity[order])

    def meeting(self, centre: Floats, half_width: float) -> Clusters:
        """Those whose bounds meet the cube around `centre` (3,), relative to the scene's origin."""
        low, high = self._bounds[:, 0], self._bounds[:, 1]
        meets = ((low <= centre + half_width) & (high >= centre - half_width)).all(axis=1)
        some = copy.copy(self)
        some.runs, some._bounds = self.runs[meets], self._bounds[meets]
        return some

    def of(self, triangles: NDArray[np.int64]) -> Clusters:
        """Each of `triangles` (n,), the scene's indices, as a cluster of its own."""
        order = np.argsort(self.runs[:, 1])
        run = order[np.searchsorted(self.runs[order, 1], triangles, side="right") - 1]
        some = copy.copy(self)
        some.runs = np.stack([self.runs[run, 0], triangles, np.ones_like(triangles)], axis=1)
        some._bounds = np.empty((len(triangles), 2, 3))
        _measure(self._positions, self._indices, some.runs, some._bounds)
        return some

    def opaque(self) -> Clusters:
        """Those without holes."""
        solid = self._cutouts.kind[self.runs[:, 0]] == OPAQUE
        some = copy.copy(self)
        some.runs, some._bounds = self.runs[solid], self._bounds[solid]
        return some

    def draw(
        self,
        clusters: InView,
        eye: Floats,
        face: int,
        nearest: float,
        tiles: Tiles,
        holes: bool = True,
    ) -> None:
        """Draw all triangles of `clusters` beyond Z = `nearest` into `tiles`.

        Without `holes`, foliage and glass are drawn as if they had none.
        """
        opaque = self._cutouts.kind[self.runs[clusters.cluster, 0]] == OPAQUE
        opaque = opaque | (not holes)
        # what has holes comes last, when most of it is hidden
        for part, cutouts in ((opaque, None), (~opaque, self._cutouts)):
            if not part.any():
                continue
            some = clusters.take(part)
            draw_clusters(
                self._positions,
                self._indices,
                self.runs[some.cluster],
                some.rect,
                some.disparity,
                ~self._double_sided,
                cutouts,
                np.asarray(eye, np.float64) - self._origin,
                _axes(face),
                nearest,
                tiles.disparity,
                tiles.triangle,
                tiles.floor,
                tiles.stale,
            )

    def by_batch(self, triangles: Ints) -> ByBatch:
        """Group `triangles` (n,), the scene's indices, by batch."""
        order = np.argsort(self.runs[:, 1])
        run = order[np.searchsorted(self.runs[order, 1], triangles, side="right") - 1]
        batch = self.runs[run, 0]
        ids = triangles[np.argsort(batch, kind="stable")].astype(np.int32)
        starts = np.searchsorted(np.sort(batch), np.arange(self._batches + 1)).astype(np.int32)
        return ByBatch(self._indices[ids], ids, starts)

    def triangles(
        self, clusters: InView, eye: Floats, face: int, nearest: float, resolution: int
    ) -> ByBatch:
        """Triangles of `clusters` that may draw something."""
        total = int(clusters.triangles.sum())
        kept = np.empty(total, np.int32)
        batch = self.runs[clusters.cluster, 0]
        order = np.argsort(batch, kind="stable")
        starts = np.zeros(self._batches + 1, np.int32)
        count = _collect(
            self._positions,
            self._indices,
            self.runs[clusters.cluster[order]],
            self._double_sided,
            (np.asarray(eye, np.float64) - self._origin).astype(np.float32),
            _axes(face).astype(np.float32),
            nearest,
            resolution,
            kept,
            starts,
        )
        kept = kept[:count].copy()
        return ByBatch(self._indices[kept], kept, starts)


def _axes(face: int) -> Floats:
    _, right, down, forward = FACES[face]
    return np.stack([right, down, forward])


@njit(cache=True)
def _measure(positions: Any, indices: Any, runs: Any, bounds: Any) -> None:
    """Bounds of every cluster."""
    for r in range(len(runs)):
        for a in range(3):
            bounds[r, 0, a], bounds[r, 1, a] = np.inf, -np.inf
        for t in range(runs[r, 1], runs[r, 1] + runs[r, 2]):
            for i in range(3):
                for a in range(3):
                    p = positions[indices[t, i], a]
                    bounds[r, 0, a] = min(bounds[r, 0, a], p)
                    bounds[r, 1, a] = max(bounds[r, 1, a], p)


@njit(cache=True)
def _project(
    bounds: Any, eye: Any, axes: Any, nearest: float, resolution: int, rect: Any, disparity: Any
) -> None:
    """Rectangle and greatest disparity of every cluster's bounds; disparity 0 if out of view."""
    q = np.empty(3)
    for r in range(len(bounds)):
        disparity[r] = 0.0
        u0 = v0 = near = np.inf
        u1 = v1 = far = -np.inf
        left = right = above = below = True
        for corner in range(8):
            for a in range(3):
                q[a] = bounds[r, (corner >> a) & 1, a] - eye[a]
            x = axes[0, 0] * q[0] + axes[0, 1] * q[1] + axes[0, 2] * q[2]
            y = axes[1, 0] * q[0] + axes[1, 1] * q[1] + axes[1, 2] * q[2]
            z = axes[2, 0] * q[0] + axes[2, 1] * q[1] + axes[2, 2] * q[2]
            slack = 1e-5 * (abs(x) + abs(y) + abs(z)) + 1e-5
            near, far = min(near, z - slack), max(far, z + slack)
            left, right = left and x < -z - slack, right and x > z + slack
            above, below = above and y < -z - slack, below and y > z + slack
            if z > 0.0:
                u0, u1 = min(u0, x / z), max(u1, x / z)
                v0, v1 = min(v0, y / z), max(v1, y / z)
        if far < nearest or left or right or above or below:
            continue
        if near < nearest:
            # the bounds reach behind the near plane: they may cover anything
            u0, v0, u1, v1 = -1.0, -1.0, 1.0, 1.0
        half = 0.5 * resolution
        rect[r, 0] = int(min(max((u0 + 1.0) * half - 1.0, 0.0), resolution - 1.0))
        rect[r, 1] = int(min(max((v0 + 1.0) * half - 1.0, 0.0), resolution - 1.0))
        rect[r, 2] = int(min(max((u1 + 1.0) * half + 2.0, 1.0), resolution))
        rect[r, 3] = int(min(max((v1 + 1.0) * half + 2.0, 1.0), resolution))
        disparity[r] = 1.0 / max(near, nearest)


@njit(cache=True)
def _collect(
    positions: Any,
    indices: Any,
    runs: Any,
    double_sided: Any,
    eye: Any,
    axes: Any,
    nearest: float,
    resolution: int,
    kept: Any,
    starts: Any,
) -> int:
    """Triangles of `runs`, sorted by batch, that may cover a texel's centre."""
    count = 0
    half = 0.5 * resolution
    c = np.empty((3, 3), np.float32)
    last = 0
    for r in range(len(runs)):
        while last < runs[r, 0]:
            last += 1
            starts[last] = count
        one_sided = not double_sided[runs[r, 0]]
        for t in range(runs[r, 1], runs[r, 1] + runs[r, 2]):
            left = right = above = below = True
            near, far = np.inf, -np.inf
            for i in range(3):
                v = indices[t, i]
                x, y, z = (
                    positions[v, 0] - eye[0],
                    positions[v, 1] - eye[1],
                    positions[v, 2] - eye[2],
                )
                c[i, 0] = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
                c[i, 1] = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
                c[i, 2] = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
                near, far = min(near, c[i, 2]), max(far, c[i, 2])
                left, right = left and c[i, 0] < -c[i, 2], right and c[i, 0] > c[i, 2]
                above, below = above and c[i, 1] < -c[i, 2], below and c[i, 1] > c[i, 2]
            if far < nearest or left or right or above or below:
                continue
            if near >= nearest and _slips(c, half, one_sided):
                continue
            kept[count] = t
            count += 1
    while last < len(starts) - 1:
        last += 1
        starts[last] = count
    return count


@njit(cache=True)
def _slips(c: Any, half: float, one_sided: bool) -> bool:
    """Whether a triangle in front of the eye faces away or lies between texel centres."""
    x0, y0 = (c[0, 0] / c[0, 2] + 1.0) * half, (c[0, 1] / c[0, 2] + 1.0) * half
    x1, y1 = (c[1, 0] / c[1, 2] + 1.0) * half, (c[1, 1] / c[1, 2] + 1.0) * half
    x2, y2 = (c[2, 0] / c[2, 2] + 1.0) * half, (c[2, 1] / c[2, 2] + 1.0) * half
    low, high = min(x0, x1, x2) - SNAP, max(x0, x1, x2) + SNAP
    if np.floor(high - 0.5) < np.ceil(low - 0.5):
        return True
    reach = high - low
    low, high = min(y0, y1, y2) - SNAP, max(y0, y1, y2) + SNAP
    if np.floor(high - 0.5) < np.ceil(low - 0.5):
        return True
    reach += high - low
    # rows run down, so a front face, counter-clockwise seen from the eye, has a negative area
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    return bool(one_sided and area > 4.0 * SNAP * reach)
