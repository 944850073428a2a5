"""Which triangles can draw in which layer of a face: index lists for the culled renderer.

Blocks are dropped by their bounds, then triangles one by one: outside the face's frustum, nearer
than the near field, facing away, or between texel centres. What is left goes to every layer that
its disparities reach. Each layer also gets the rectangle of texels that its triangles can touch.

The GPU must agree that what is dropped here draws nothing. It snaps vertices to a grid of 1/256
pixel (at least 4 bits by the GL specification) and interpolates in 32-bit floats, so a fragment of
a steep sliver may get a disparity beyond those of its corners: every triangle's interval is grown
by what its disparity changes over `SNAP` pixels, and that of triangles too thin for their own
gradient to be trusted is unbounded.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

#: Pixels by which the rasteriser's idea of a triangle may differ from ours.
SNAP = 1.0 / 32.0
#: Relative rounding of a projected coordinate on the GPU, several float32 steps.
ROUNDING = 1e-6


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
        self._camera_space = np.empty((len(scene.positions), 3), np.float32)

    def lists(
        self,
        eye: NDArray[np.float32],
        face: int,
        disparities: NDArray[np.float32],
        near: np.float32,
        resolution: int,
    ) -> Lists:
        """Lists for a face seen from `eye` (3,) float32, relative to the scene's origin.

        `disparities` and `near`, the near clip plane, are those of `borders`.
        """
        blocks = self._visible_blocks(eye.astype(np.float64), face, float(near))
        parts = np.ascontiguousarray(self._parts[blocks[self._parts[:, 1]]])
        axes = np.stack([FACES[face].right, FACES[face].down, FACES[face].forward])
        component = np.abs(axes).argmax(axis=1)
        sign = axes[np.arange(3), component].astype(np.float32)
        _to_camera(
            self._positions,
            self._vertices[blocks],
            eye,
            component,
            sign,
            self._camera_space,
        )
        layers = len(disparities) - 1
        total = int(parts[:, 3].sum())
        spans = np.empty((total, 2), np.int32)
        counts = np.zeros((layers, self._batches), np.int64)
        rectangles = np.tile(np.array([resolution, resolution, 0, 0], np.int32), (layers, 1))
        _classify(
            self._camera_space,
            self._triangles,
            parts,
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
        for plane, offset in (
            (forward, -near),
            (forward - right, 0.0),
            (forward + right, 0.0),
            (forward - down, 0.0),
            (forward + down, 0.0),
        ):
            farthest = np.where(plane > 0, self._high, self._low) - eye
            # The bounds are float32 numbers: allow for their rounding.
            slack = 1e-6 * (np.abs(farthest).sum(axis=1) + np.abs(eye).sum())
            visible &= farthest @ plane + offset >= -slack
        return visible


@numba.njit(cache=True)
def _to_camera(positions: Any, ranges: Any, eye: Any, component: Any, sign: Any, out: Any) -> None:
    """X, Y, Z of the vertices in `ranges`, in the same float32 steps as the vertex shader."""
    for r in range(len(ranges)):
        for v in range(ranges[r, 0], ranges[r, 0] + ranges[r, 1]):
            for a in range(3):
                c = component[a]
                out[v, a] = sign[a] * (positions[v, c] - eye[c])


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def _slab_bounds(corners: Any, near: float, far: float, out: Any) -> bool:
    """Bounds of X/Z and Y/Z over the part of a triangle with Z in [near, far], near > 0.

    `corners` is (3, 3): X, Y, Z of each corner. Writes u0, v0, u1, v1; False where nothing is left.
    """
    out[0] = out[1] = np.inf
    out[2] = out[3] = -np.inf
    for i in range(3):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        if near <= z <= far:
            out[0], out[2] = min(out[0], x / z), max(out[2], x / z)
            out[1], out[3] = min(out[1], y / z), max(out[3], y / z)
        j = (i + 1) % 3
        dz = corners[j, 2] - z
        for plane in (near, far):
            if (z < plane) != (corners[j, 2] < plane):
                t = (plane - z) / dz
                u = (x + t * (corners[j, 0] - x)) / plane
                v = (y + t * (corners[j, 1] - y)) / plane
                out[0], out[2] = min(out[0], u), max(out[2], u)
                out[1], out[3] = min(out[1], v), max(out[3], v)
    return bool(out[0] <= out[2])


@numba.njit(cache=True)
def _pixels(bounds: Any, resolution: int, out: Any) -> bool:
    """Texels whose centres lie within `bounds` grown by SNAP; False where there are none."""
    half = 0.5 * resolution
    for axis in range(2):
        first = np.ceil(max((bounds[axis] + 1.0) * half - SNAP - 0.5, 0.0))
        last = np.floor(min((bounds[axis + 2] + 1.0) * half + SNAP - 0.5, resolution - 1.0))
        if first > last:
            return False
        out[axis], out[axis + 2] = int(first), int(last) + 1
    return True


@numba.njit(cache=True)
def _slack(corners: Any, in_front: bool, resolution: int, single_sided: bool) -> float:
    """By how much a fragment's disparity may leave the triangle's range; negative: no fragments.

    The plane through the corners has disparity (n . (u, v, 1)) / (n . p), n = edge x edge, p any
    corner; n . p is negative on the front.
    """
    ax, ay, az = corners[1] - corners[0]
    bx, by, bz = corners[2] - corners[0]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    offset = nx * corners[0, 0] + ny * corners[0, 1] + nz * corners[0, 2]
    pixel = 2.0 / resolution
    gradient = (abs(nx) + abs(ny)) * pixel / max(abs(offset), 1e-300)
    z0, z1, z2 = corners[0, 2], corners[1, 2], corners[2, 2]
    if not in_front:
        # The clipper's new corners are rounded too; edge-on its triangles are slivers.
        reach = np.sqrt((nx * nx + ny * ny + nz * nz) * (corners * corners).sum())
        return gradient * SNAP + 0.01 / max(z0, z1, z2) if abs(offset) > 1e-3 * reach else np.inf
    area = abs(offset) / (z0 * z1 * z2) / (pixel * pixel)
    length = 0.0
    reach = 1.0
    for i in range(3):
        j = (i + 1) % 3
        for k in range(2):
            length += abs(corners[i, k] / corners[i, 2] - corners[j, k] / corners[j, 2]) / pixel
            reach = max(reach, abs(corners[i, k] / corners[i, 2]))
    if single_sided and offset > 0.0 and area > SNAP * length:
        return -1.0
    doubt = ROUNDING * (reach / pixel) * length / max(area, 1e-300)
    if doubt > 0.5:
        return np.inf
    least, greatest = 1.0 / max(z0, z1, z2), 1.0 / min(z0, z1, z2)
    return float(gradient * SNAP + (greatest - least) * doubt + 1e-5 * greatest)


@numba.njit(cache=True)
def _classify(
    camera_space: Any,
    triangles: Any,
    parts: Any,
    double_sided: Any,
    disparities: Any,
    near_clip: float,
    resolution: int,
    spans: Any,
    counts: Any,
    rectangles: Any,
) -> None:
    """First and last layer of each triangle in `parts` (last < first: dropped), and rectangles."""
    layers = len(disparities) - 1
    corners = np.empty((3, 3), np.float64)
    bounds = np.empty(4, np.float64)
    pixels = np.empty(4, np.int64)
    row = -1
    for p in range(len(parts)):
        batch = parts[p, 0]
        for t in range(parts[p, 2], parts[p, 2] + parts[p, 3]):
            row += 1
            spans[row, 0], spans[row, 1] = 0, -1
            left = right = above = below = True
            nearest, farthest = np.inf, -np.inf
            for i in range(3):
                corners[i] = camera_space[triangles[t, i]]
                x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
                left, right = left and x < -z, right and x > z
                above, below = above and y < -z, below and y > z
                nearest, farthest = min(nearest, z), max(farthest, z)
            if farthest < near_clip or left or right or above or below:
                continue
            in_front = nearest >= near_clip
            if not _slab_bounds(corners, near_clip, farthest, bounds):
                continue
            if not _pixels(bounds, resolution, pixels):
                continue
            slack = _slack(corners, in_front, resolution, not double_sided[batch])
            if slack < 0.0:
                continue
            first = _first_layer(disparities, max(1.0 / farthest - slack, 0.0))
            last = _first_layer(disparities, 1.0 / max(nearest, near_clip) + slack)
            last = min(last, layers - 1)
            if first > last:
                continue
            spans[row, 0], spans[row, 1] = first, last
            for layer in range(first, last + 1):
                counts[layer, batch] += 1
                if first < last and slack < np.inf:
                    # Only the part between the layer's borders: a long street touches few rows.
                    far = 1.0 / max(disparities[layer] - slack, 1e-30)
                    near = max(1.0 / (disparities[layer + 1] + slack), near_clip)
                    if not _slab_bounds(corners, near, min(far, farthest), bounds):
                        continue
                    if not _pixels(bounds, resolution, pixels):
                        continue
                rectangle = rectangles[layer]
                rectangle[0] = min(rectangle[0], pixels[0])
                rectangle[1] = min(rectangle[1], pixels[1])
                rectangle[2] = max(rectangle[2], pixels[2])
                rectangle[3] = max(rectangle[3], pixels[3])


@numba.njit(cache=True)
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
