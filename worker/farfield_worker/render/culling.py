"""Which triangles can draw in which layer of a face: index lists for the culled renderer.

Blocks are dropped by their bounds, then triangles one by one: outside the face's frustum, nearer
than the near field, facing away, or between texel centres. What is left goes to every layer that
its disparities reach. Each layer also gets the rectangle of texels that its triangles can touch.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.render.reach import (
    SNAP,
    clipped_slack,
    covers_any,
    disparity_slack,
    plane,
    slab_bounds,
    texels_within,
)

#: Triangles over at most this many texels are tested texel by texel.
FEW_TEXELS = 4


class Lists(NamedTuple):
    """Index lists of one face.

    Attributes:
        indices: (n, 3) uint32, vertices of the triangles to draw, by layer, then batch, then in
            the scene's order; a triangle that reaches several layers is listed in each.
        starts: (layers, batches + 1) int64, where each list starts; a layer's last entry is
            its end.
        rectangles: (layers, 4) int32, x0, y0, x1, y1 of the texels a layer can touch, ends
            excluded; empty (x0 >= x1) where the layer is.
    """

    indices: NDArray[np.uint32]
    starts: NDArray[np.int64]
    rectangles: NDArray[np.int32]


class Culler:
    """Culls a prepared scene for faces; keeps what does not depend on the face."""

    def __init__(self, scene: PreparedScene) -> None:
        info = scene.info
        # Plain views: numba compiles anew for every subclass of ndarray.
        self._positions = np.asarray(scene.positions)
        self._triangles = np.asarray(scene.triangles)
        self._batches = len(info.batches)
        self._low = np.array([b.low for b in info.blocks], np.float64).reshape(-1, 3)
        self._high = np.array([b.high for b in info.blocks], np.float64).reshape(-1, 3)
        self._vertices = np.array(
            [(b.first_vertex, b.vertices) for b in info.blocks], np.int64
        ).reshape(-1, 2)
        parts = [
            (part.batch, number, part.first_triangle, part.triangles)
            for number, block in enumerate(info.blocks)
            for part in block.parts
        ]
        #: by batch, then block: the order in which everything is drawn
        self._parts = np.array(sorted(parts), np.int64).reshape(-1, 4)
        self._double_sided = np.array([b.double_sided for b in info.batches], np.bool_)

    def lists(
        self,
        eye: NDArray[np.float32],
        face: int,
        depths: NDArray[np.float32],
        near: np.float32,
        resolution: int,
    ) -> Lists:
        """Lists for a face seen from `eye` (3,) float32, relative to the scene's origin.

        `depths` of borders and `near`, the distance of the near clip plane, are those of `borders`.
        """
        disparities = depths.astype(np.float64) / near
        blocks = self._visible_blocks(eye.astype(np.float64), face, float(near))
        parts = np.ascontiguousarray(self._parts[blocks[self._parts[:, 1]]])
        axes = np.stack([FACES[face].right, FACES[face].down, FACES[face].forward])
        component = np.abs(axes).argmax(axis=1)
        layers = len(disparities) - 1
        rows = np.cumsum(parts[:, 3]) - parts[:, 3]
        spans = np.empty((int(parts[:, 3].sum()), 2), np.int32)
        counts = np.zeros((layers, self._batches), np.int64)
        rectangles = np.tile(np.array([resolution, resolution, 0, 0], np.int32), (layers, 1))
        by_block = np.argsort(parts[:, 1], kind="stable")
        _classify(
            self._positions,
            self._triangles,
            self._vertices,
            np.ascontiguousarray(parts[by_block]),
            rows[by_block],
            eye,
            component,
            axes[np.arange(3), component].astype(np.float32),
            self._double_sided,
            disparities,
            float(near),
            resolution,
            spans,
            counts,
            rectangles,
        )
        ends = np.cumsum(counts.ravel()).reshape(counts.shape)
        starts = np.empty((layers, self._batches + 1), np.int64)
        starts[:, :-1] = ends - counts
        starts[:, -1] = ends[:, -1] if self._batches else 0
        indices = np.empty((int(counts.sum()), 3), np.uint32)
        _fill(self._triangles, parts, spans, starts[:, :-1].copy(), indices)
        return Lists(indices, starts, rectangles)

    def _visible_blocks(
        self, eye: NDArray[np.float64], face: int, near: float
    ) -> NDArray[np.bool_]:
        """Blocks whose bounds reach into the face's frustum beyond `near`, (blocks,) bool."""
        _, right, down, forward = FACES[face]
        visible = np.ones(len(self._low), np.bool_)
        for normal, offset in (
            (forward, -near),
            (forward - right, 0.0),
            (forward + right, 0.0),
            (forward - down, 0.0),
            (forward + down, 0.0),
        ):
            farthest = np.where(normal > 0, self._high, self._low) - eye
            # The bounds are float32 numbers: allow for their rounding.
            slack = 1e-6 * (np.abs(farthest).sum(axis=1) + np.abs(eye).sum())
            visible &= farthest @ normal + offset >= -slack
        return visible


@numba.njit(cache=True, error_model="numpy")
def _first_layer(disparities: Any, d: float) -> int:
    """The layer that holds disparity `d`; the number of layers where d is nearer than all."""
    low, high = 0, len(disparities) - 1
    while low < high:
        middle = (low + high) // 2
        if d <= disparities[middle + 1]:
            high = middle
        else:
            low = middle + 1
    return low


@numba.njit(cache=True, error_model="numpy")
def _project(
    positions: Any,
    eye: Any,
    component: Any,
    sign: Any,
    near: float,
    half: float,
    camera: Any,
    screen: Any,
) -> None:
    """X, Y, Z and pixels of vertices, in the same float32 steps as the vertex shader."""
    for n in range(len(positions)):
        for a in range(3):
            camera[n, a] = sign[a] * (positions[n, component[a]] - eye[component[a]])
        if camera[n, 2] >= near:
            scale = half / camera[n, 2]
            screen[n, 0] = camera[n, 0] * scale + half
            screen[n, 1] = camera[n, 1] * scale + half


@numba.njit(cache=True, error_model="numpy")
def _examine_clipped(
    corners: Any, near: float, resolution: int, texels: Any, bounds: Any, normal: Any
) -> float:
    """`_examine` for a triangle that the near clip plane cuts."""
    farthest = max(corners[0, 2], corners[1, 2], corners[2, 2])
    if not slab_bounds(corners, near, farthest, 0.5 * resolution, bounds):
        return -1.0
    if not texels_within(bounds, resolution, texels):
        return -1.0
    return float(clipped_slack(corners, near, resolution, normal, plane(corners, normal)))


@numba.njit(cache=True, error_model="numpy")
def _examine(
    corners: Any,
    screen: Any,
    resolution: int,
    single_sided: bool,
    texels: Any,
    bounds: Any,
    normal: Any,
) -> float:
    """Slack of a triangle's disparities (see `reach`), -1 if it draws nothing; writes its texels.

    `corners` (3, 3) are X, Y, Z, `screen` (3, 2) pixels; `bounds` and `normal` are room to work in.
    """
    for axis in range(2):
        bounds[axis] = min(screen[0, axis], screen[1, axis], screen[2, axis])
        bounds[axis + 2] = max(screen[0, axis], screen[1, axis], screen[2, axis])
    if not texels_within(bounds, resolution, texels):
        return -1.0
    offset = plane(corners, normal)
    half = 0.5 * resolution
    area = offset * half * half / (corners[0, 2] * corners[1, 2] * corners[2, 2])
    length = bounds[2] - bounds[0] + bounds[3] - bounds[1]
    if single_sided and area > 4.0 * SNAP * (length + SNAP):
        return -1.0
    few = (texels[2] - texels[0]) * (texels[3] - texels[1]) <= FEW_TEXELS
    if few and not covers_any(screen, texels):
        return -1.0
    return float(disparity_slack(corners, screen, resolution, normal, offset))


@numba.njit(cache=True, error_model="numpy")
def _extend(rectangle: Any, texels: Any) -> None:
    """Make a rectangle include another."""
    for k in range(2):
        rectangle[k] = min(rectangle[k], texels[k])
        rectangle[k + 2] = max(rectangle[k + 2], texels[k + 2])


@numba.njit(cache=True, error_model="numpy")
def _classify(
    positions: Any,
    triangles: Any,
    vertices: Any,
    parts: Any,
    rows: Any,
    eye: Any,
    component: Any,
    sign: Any,
    double_sided: Any,
    disparities: Any,
    near: float,
    resolution: int,
    spans: Any,
    counts: Any,
    rectangles: Any,
) -> None:
    """First and last layer of each triangle in `parts` (last < first: dropped), and rectangles.

    `parts` come block by block; `rows` says where the spans of each are to be written.
    """
    layers, half = len(disparities) - 1, 0.5 * resolution
    most = vertices[:, 1].max() if len(vertices) else 0
    camera, screen = np.empty((most, 3), np.float32), np.empty((most, 2), np.float32)
    corners, projected = np.empty((3, 3)), np.empty((3, 2))
    bounds, normal, texels = np.empty(4), np.empty(3), np.empty(4, np.int64)
    block = -1
    for p in range(len(parts)):
        batch = parts[p, 0]
        if parts[p, 1] != block:
            block = parts[p, 1]
            start, end = vertices[block, 0], vertices[block, 0] + vertices[block, 1]
            _project(positions[start:end], eye, component, sign, near, half, camera, screen)
        for t in range(parts[p, 3]):
            row = rows[p] + t
            spans[row, 0], spans[row, 1] = 0, -1
            for i in range(3):
                v = triangles[parts[p, 2] + t, i] - start
                # component by component: rows would become temporary arrays
                corners[i, 0], corners[i, 1], corners[i, 2] = (
                    camera[v, 0],
                    camera[v, 1],
                    camera[v, 2],
                )
                projected[i, 0], projected[i, 1] = screen[v, 0], screen[v, 1]
            nearest = min(corners[0, 2], corners[1, 2], corners[2, 2])
            farthest = max(corners[0, 2], corners[1, 2], corners[2, 2])
            if farthest < near:
                continue
            if nearest < near:
                slack = _examine_clipped(corners, near, resolution, texels, bounds, normal)
                nearest = near
            else:
                single_sided = not double_sided[batch]
                slack = _examine(
                    corners, projected, resolution, single_sided, texels, bounds, normal
                )
            if slack < 0.0:
                continue
            first = _first_layer(disparities, max(1.0 / farthest - slack, 0.0))
            last = min(_first_layer(disparities, 1.0 / nearest + slack), layers - 1)
            spans[row, 0], spans[row, 1] = first, last
            for layer in range(first, last + 1):
                counts[layer, batch] += 1
                if first == last or slack == np.inf:
                    _extend(rectangles[layer], texels)
                    continue
                # Only the part between the layer's borders: a long street touches few rows.
                far_end = min(1.0 / max(disparities[layer] - slack, 1e-30), farthest)
                near_end = max(1.0 / (disparities[layer + 1] + slack), near)
                if slab_bounds(corners, near_end, far_end, half, bounds) and texels_within(
                    bounds, resolution, texels
                ):
                    _extend(rectangles[layer], texels)


@numba.njit(cache=True, error_model="numpy")
def _fill(triangles: Any, parts: Any, spans: Any, cursor: Any, indices: Any) -> None:
    """Copy each triangle's vertices to the lists of its layers."""
    row = -1
    for p in range(len(parts)):
        batch = parts[p, 0]
        for t in range(parts[p, 2], parts[p, 2] + parts[p, 3]):
            row += 1
            for layer in range(spans[row, 0], spans[row, 1] + 1):
                at = cursor[layer, batch]
                cursor[layer, batch] = at + 1
                for i in range(3):
                    indices[at, i] = triangles[t, i]
