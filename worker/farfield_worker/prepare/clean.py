"""Take out of a model what has no area or is no number, so that later stages need not ask."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.model import Mesh, Model

#: a transform whose determinant is this small against its entries flattens a mesh
_FLAT = 1e-12


def clean(model: Model) -> None:
    """Drop degenerate triangles and those of non-finite vertices, in place, with a note."""
    _flatten(model)
    dropped = 0
    copies = np.bincount(model.placed, minlength=len(model.meshes))
    for mesh, count in zip(model.meshes, copies.tolist(), strict=True):
        good = areas(mesh.positions, mesh.triangles) > 0
        if not good.all():
            dropped += int((~good).sum()) * count
            mesh.triangles = mesh.triangles[good]
        if mesh.uvs is not None and not np.isfinite(mesh.uvs).all():
            mesh.uvs = np.nan_to_num(mesh.uvs, nan=0, posinf=0, neginf=0)
        if mesh.normals is not None and not np.isfinite(mesh.normals).all():
            mesh.normals = np.nan_to_num(mesh.normals, nan=0, posinf=0, neginf=0)
    if dropped:
        model.notes.append(f"{dropped} triangles without area were left out.")


def areas(positions: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float64]:
    """Twice the area of each triangle, (m,) float; 0 for one with a non-finite corner."""
    out = np.empty(len(triangles))
    step = 1 << 20  # bounds the temporary arrays
    for start in range(0, len(triangles), step):
        corner = positions[triangles[start : start + step]].astype(np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            length = np.sqrt((cross * cross).sum(axis=1))
        out[start : start + step] = np.where(np.isfinite(length), length, 0)
    return out


def _flatten(model: Model) -> None:
    """Give instances under singular transforms a mesh of their own, already in scene space."""
    linear = model.matrices[:, :3, :3]
    size = np.abs(linear).max(axis=(1, 2), initial=0)
    with np.errstate(invalid="ignore", over="ignore"):
        singular = ~(np.abs(np.linalg.det(linear)) > _FLAT * size**3)
    for row in np.flatnonzero(singular):
        mesh, matrix = model.meshes[model.placed[row]], model.matrices[row]
        positions = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        flat = Mesh(
            positions.astype(np.float32), mesh.triangles, mesh.material, None, mesh.uvs, mesh.colors
        )
        model.placed[row] = len(model.meshes)
        model.matrices[row] = np.eye(4)
        if model.copies is not None:
            model.copies[row] = -1
        model.meshes.append(flat)
