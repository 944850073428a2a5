"""All meshes end to end in flat arrays, instances beside them: what the expansion loops run on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.batches import Look
from farfield_worker.prepare.model import Model


@dataclass(frozen=True)
class Assembly:
    """A model without Python objects.

    Attributes:
        positions: (v, 3) float32, mesh space.
        normals: (v, 3) float32, any length; zero: flat.
        uvs: (v, 2) float32; zero where the batch has no texture.
        colors: (v, 4) uint16, base colour factor included.
        corners: (t, 3) uint32, vertices of each mesh triangle.
        first: (k,) int64, first mesh triangle of each instance.
        drawn: (k + 1,) int64, running count of drawn triangles before each instance.
        batch: (k,) int32.
        linear, shift: (k, 3, 3) and (k, 3) float64, mesh space to scene space.
        turned: (k,) bool, the instance mirrors its mesh.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32]
    colors: NDArray[np.uint16]
    corners: NDArray[np.uint32]
    first: NDArray[np.int64]
    drawn: NDArray[np.int64]
    batch: NDArray[np.int32]
    linear: NDArray[np.float64]
    shift: NDArray[np.float64]
    turned: NDArray[np.bool_]

    @property
    def triangles(self) -> int:
        """Number of drawn triangles."""
        return int(self.drawn[-1])


def assemble(model: Model, looks: list[Look]) -> Assembly:
    """Flatten `model`, emptying its list of meshes on the way to keep memory low."""
    sizes = [0 if look.batch < 0 else len(m.triangles) for m, look in _pairs(model, looks)]
    vertices = sum(
        len(mesh.positions)
        for (mesh, _), size in zip(_pairs(model, looks), sizes, strict=True)
        if size
    )
    positions = np.empty((vertices, 3), np.float32)
    normals = np.zeros((vertices, 3), np.float32)
    uvs = np.zeros((vertices, 2), np.float32)
    colors = np.empty((vertices, 4), np.uint16)
    starts = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])
    corners = np.empty((int(starts[-1]), 3), np.uint32)
    low = 0
    for index, look in enumerate(looks):
        mesh = model.meshes[index]
        if sizes[index] == 0:
            continue
        high = low + len(mesh.positions)
        positions[low:high] = mesh.positions
        if mesh.normals is not None:
            normals[low:high] = mesh.normals
        if mesh.uvs is not None and look.textured:
            uvs[low:high] = mesh.uvs
        factor = np.array(look.factor)
        if mesh.colors is None:
            colors[low:high] = np.rint(factor * 65535)
        else:
            colors[low:high] = np.rint(mesh.colors * factor)
        corners[starts[index] : starts[index + 1]] = mesh.triangles + np.uint32(low)
        mesh.positions = mesh.positions[:0]
        mesh.normals = mesh.uvs = mesh.colors = None
        low = high
    counts = np.array(sizes, np.int64)[model.placed]
    linear = np.ascontiguousarray(model.matrices[:, :3, :3])
    return Assembly(
        positions,
        normals,
        uvs,
        colors,
        corners,
        starts[model.placed],
        np.concatenate([[0], np.cumsum(counts)]),
        np.array([look.batch for look in looks], np.int32)[model.placed],
        linear,
        np.ascontiguousarray(model.matrices[:, :3, 3]),
        np.linalg.det(linear) < 0,
    )


def _pairs(model: Model, looks: list[Look]) -> list[tuple]:  # type: ignore[type-arg]
    return list(zip(model.meshes, looks, strict=True))
