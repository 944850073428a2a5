"""The two cameras that a scene's pictures are taken with, as GL matrices."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: share of its size by which the map reaches beyond the scene
_MARGIN = 0.02


@dataclass(frozen=True)
class Camera:
    """Where a picture is taken from.

    Attributes:
        matrix: (4, 4) float, scene (relative to its origin) to clip space, column vectors.
        rays: (3, 3) float; the direction through a pixel at clip x, y is rays @ (x, y, 1).
    """

    matrix: Floats
    rays: Floats


def top_view(
    low: Floats, high: Floats, longest: int
) -> tuple[Camera, tuple[Floats, Floats], tuple[int, int]]:
    """Parallel view from above, columns along +x, rows along +z.

    Returns the camera, the rectangle of ground (x, z) it shows, min and max, and the picture's
    width and height, at most `longest` pixels, all pixels square.
    """
    extent = np.maximum(high - low, 1e-9)
    side = max(extent[0], extent[2]) * (1 + 2 * _MARGIN)
    metres = side / longest
    width = max(1, math.ceil((extent[0] + 2 * _MARGIN * side) / metres - 1e-9))
    height = max(1, math.ceil((extent[2] + 2 * _MARGIN * side) / metres - 1e-9))
    width, height = min(width, longest), min(height, longest)
    centre = (low + high) / 2
    half = np.array([width, height]) * metres / 2
    ground = centre[[0, 2]]
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 3] = 1 / half[0], -centre[0] / half[0]
    matrix[1, 2], matrix[1, 3] = -1 / half[1], centre[2] / half[1]
    # height to depth, upper nearer, with room so that nothing lies on a clip plane
    matrix[2, 1], matrix[2, 3] = -1.8 / extent[1], 1.8 * centre[1] / extent[1]
    matrix[3, 3] = 1
    rays = np.array([[0.0, 0, 0], [0, 0, -1], [0, 0, 0]])
    return Camera(matrix, rays), (ground - half, ground + half), (width, height)


def look_at_box(low: Floats, high: Floats, aspect: float, fov: float = 0.6) -> Camera:
    """Perspective view of a box from above one of its corners, as near as it fits.

    Args:
        low, high: (3,) float, the box.
        aspect: width / height.
        fov: height of the view, radians.
    """
    size = np.maximum(high - low, 1e-9)
    back = np.array([0.62, 0.55, 0.75])
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    axes = np.stack([right, up, back])
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    seen = corners * size @ axes.T
    t = math.tan(fov / 2)
    reach = np.maximum(np.abs(seen[:, 0]) / (t * aspect), np.abs(seen[:, 1]) / t)
    distance = 1.04 * float((seen[:, 2] + reach).max())
    radius = float(np.linalg.norm(size)) / 2
    near = max(distance - 4 * radius, distance * 1e-3)
    far = distance + 40 * radius
    view = np.eye(4)
    view[:3, :3] = axes
    view[:3, 3] = -axes @ ((low + high) / 2 + back * distance)
    lens = np.zeros((4, 4))
    lens[0, 0], lens[1, 1] = 1 / (t * aspect), 1 / t
    lens[2, 2], lens[2, 3] = -(far + near) / (far - near), -2 * far * near / (far - near)
    lens[3, 2] = -1
    rays = axes.T @ np.diag([t * aspect, t, -1.0])
    return Camera(lens @ view, rays)
