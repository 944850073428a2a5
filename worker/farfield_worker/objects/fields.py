"""A true impostor: height fields with colour and normals, baked along the axis that suits best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from farfield_core.errors import BadInputError
from farfield_shading import to_srgb
from numpy.typing import NDArray

from farfield_worker.objects.columns import Crossings, cross_columns
from farfield_worker.objects.mesh import Floats, ObjectMesh, opaque_at, surface_at
from farfield_worker.objects.slabs import Slabs, is_closed, make_slabs

#: axis of the columns -> the axes of texture x, texture y and height
AXES = ((1, 2, 0), (2, 0, 1), (0, 1, 2))


#: a sheet that rises more than this many texels within one is cut off
STEEPEST = 6.0


class Fields(NamedTuple):
    """A baked object.

    Attributes:
        low, high: (3,) float64, its box, metres.
        axes: which axis of the box texture x, texture y and height run along.
        heights: (textures, resolution, resolution, 4) uint8: low and high of two slabs, in
            255ths of the box; low 255 and high 0 where there is none.
        colors: (4 textures, resolution, resolution, 3) uint8, sRGB, one for each height.
        normals: (4 textures, resolution, resolution, 3) uint8, (n + 1) / 2 in the box's axes.
        closed: by how much gaps had to be filled, as a share of all that is solid.
    """

    low: Floats
    high: Floats
    axes: tuple[int, int, int]
    heights: NDArray[np.uint8]
    colors: NDArray[np.uint8]
    normals: NDArray[np.uint8]
    closed: float


def bake_fields(mesh: ObjectMesh, resolution: int, textures: int) -> Fields:
    """Bake with `textures` height textures of `resolution` texels; raises BadInputError."""
    if len(mesh.corners) == 0:
        raise BadInputError("The model has no triangles; there is nothing to bake.")
    low, high = mesh.corners.min(axis=(0, 1)), mesh.corners.max(axis=(0, 1))
    # half a texel of air on each side, and a thickness for what is flat
    extent = np.maximum(high - low, 1e-3 * float((high - low).max()) + 1e-9)
    middle = (low + high) / 2
    extent *= resolution / (resolution - 2)
    low, high = middle - extent / 2, middle + extent / 2
    unit = (mesh.corners - low) / extent
    closed = is_closed(mesh.welded)
    best: tuple[float, tuple[int, int, int], Crossings, Slabs] | None = None
    for axes in AXES:
        thickness = float(extent[list(axes[:2])].max()) / resolution / float(extent[axes[2]])
        crossings = _opaque(mesh, cross_columns(np.ascontiguousarray(unit[..., axes]), resolution))
        half = thickness / 2 + _rise(unit[..., axes], resolution)[crossings.triangle]
        slabs = make_slabs(crossings, resolution, 2 * textures, closed, half)
        # Sheets seen edge on are crossed by few columns, gaps that were filled show as solid.
        missed = _edge_on(mesh, axes[2]) if not closed else 0.0
        loss = slabs.closed + missed
        if best is None or loss < best[0] - 1e-9:
            best = (loss, axes, crossings, slabs)
    assert best is not None
    _, axes, crossings, slabs = best
    return _fields(mesh, low, high, axes, crossings, slabs, resolution, textures)


def _opaque(mesh: ObjectMesh, crossings: Crossings) -> Crossings:
    """The crossings without those at which an alpha-masked surface has a hole."""
    keep = opaque_at(mesh, crossings.triangle, crossings.weights)
    if keep.all():
        return crossings
    counts = np.concatenate([[0], np.cumsum(keep)])
    return Crossings(
        counts[crossings.starts],
        crossings.height[keep],
        crossings.enters[keep],
        crossings.triangle[keep],
        crossings.weights[keep],
    )


def _rise(corners: Floats, resolution: int) -> Floats:
    """Half of what each triangle of (m, 3, 3) rises within a texel, at most some texels, (m,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across = np.abs(normal[:, 0]) + np.abs(normal[:, 1])
    slope = across / np.maximum(np.abs(normal[:, 2]), 1e-9 * np.maximum(across, 1e-300))
    return np.asarray(np.minimum(slope, STEEPEST) / (2 * resolution))


def _edge_on(mesh: ObjectMesh, axis: int) -> float:
    """The share of the surface that columns along `axis` run along rather than through."""
    c = mesh.corners
    area = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    whole = float(np.linalg.norm(area, axis=1).sum())
    return 1.0 - float(np.abs(area[:, axis]).sum()) / whole if whole > 0 else 0.0


def _fields(
    mesh: ObjectMesh,
    low: Floats,
    high: Floats,
    axes: tuple[int, int, int],
    crossings: Crossings,
    slabs: Slabs,
    resolution: int,
    textures: int,
) -> Fields:
    some = slabs.low <= slabs.high
    levels = np.stack(
        [
            np.where(some, np.rint(255 * slabs.low), 255),
            np.where(some, np.rint(255 * slabs.high), 0),
        ],
        axis=1,
    ).astype(np.uint8)
    # (slab, side, y, x) -> (texture, y, x, channel)
    heights = levels.reshape(textures, 4, resolution, resolution).transpose(0, 2, 3, 1)
    sides = slabs.surface.reshape(4 * textures, resolution, resolution)
    surface = surface_at(mesh, crossings.triangle, crossings.weights)
    colors = np.zeros((*sides.shape, 3), np.uint8)
    normals = np.full((*sides.shape, 3), 128, np.uint8)
    on = sides >= 0
    colors[on] = np.rint(255 * to_srgb(surface.color[sides[on]])).astype(np.uint8)
    normals[on] = np.rint(127.5 * (surface.normal[sides[on]] + 1)).astype(np.uint8)
    return Fields(low, high, axes, heights.copy(), colors, normals, slabs.closed)
