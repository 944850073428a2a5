"""The disparity plane of a triangle: a plane in space is an affine function of (u, v).

With the eye at the origin a plane is n . p = m. The point along w = forward + u right + v down at
depth Z is Z w, so d = 1 / Z = (n . w) / m: affine in u and v. A triangle whose plane passes through
the eye (m = 0) is seen edge-on and has none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class TrianglePlanes(NamedTuple):
    """Disparity planes of triangles on one face of one eye.

    Attributes:
        plane: (n, 3) float, a, b, c of d = a u + b v + c; nan where seen edge-on.
        low, high: (n,) float, least and greatest disparity of the triangle's corners; corners
            behind the eye count as infinitely near.
    """

    plane: Floats
    low: Floats
    high: Floats


def triangle_planes(face: int, eye: Floats, corners: Floats) -> TrianglePlanes:
    """Disparity planes of triangles with `corners` (n, 3, 3) metres on `face` of `eye` (3,)."""
    axes = FACES[face]
    p = np.asarray(corners, np.float64) - np.asarray(eye, np.float64)
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    m = np.einsum("ij,ij->i", normal, p[:, 0])
    size = np.linalg.norm(normal, axis=1) * np.abs(p).max(axis=(1, 2), initial=0.0)
    edge_on = np.abs(m) <= 1e-9 * size
    basis = np.stack([axes.right, axes.down, axes.forward], axis=1)
    plane = np.where(edge_on[:, None], np.nan, normal @ basis / np.where(edge_on, 1.0, m)[:, None])
    z = p @ axes.forward
    disparity = np.where(z > 0, 1.0 / np.where(z > 0, z, 1.0), np.inf)
    return TrianglePlanes(plane, disparity.min(axis=1), disparity.max(axis=1))


def seeds(
    scene: PreparedScene, eye: Floats, face: int, triangle: NDArray[np.int32]
) -> tuple[NDArray[np.int32], TrianglePlanes]:
    """Planes of the triangles that fragments show, and the row of each fragment's: (n,) int32.

    `triangle` (n,) are the scene's triangle indices, `eye` (3,) is in scene coordinates.
    """
    shown, row = np.unique(triangle, return_inverse=True)
    corners = scene.positions[scene.triangles[shown]].astype(np.float64)
    return row.astype(np.int32), triangle_planes(face, eye - scene.origin, corners)
