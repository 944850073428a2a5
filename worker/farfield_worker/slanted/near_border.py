"""Keep quads out of the near field.

The near field is a cube around the cell's centre, drawn as polygons. A plane within tolerance may
dip into it and would cover near polygons. Seen from an eye e inside, the cube's wall with outward
normal n at distance `near` from the centre is the plane of disparity (n . w) / (near - n . e), and
a point lies in the cube where its disparity exceeds the greatest of the six. So a quad is split
along that function: what lies outside stays, what lies inside is drawn on the wall that it is seen
through. The walls lie between the true surface, which is outside, and the quad: nearer the truth.
Where the surface itself goes on inside, as polygons, the quad is cut off at the border instead.
"""

from __future__ import annotations

import numpy as np
from farfield_core.faces import FACES
from numpy.typing import NDArray

from farfield_worker.slanted.clip import clip_half_plane, texel_line

Floats = NDArray[np.float64]

#: polygons smaller than this, in square texels, are dropped
SLIVER = 1e-9


def walls(face: int, eye: Floats, near: float) -> Floats:
    """Disparity planes of the near cube's walls on `face` of `eye` (3,): (m, 3) float.

    `eye` is relative to the centre of the cube of half width `near`. Walls that no ray through
    the face can leave through first are left out.
    """
    axes = FACES[face]
    basis = np.stack([axes.right, axes.down, axes.forward], axis=1)
    planes = []
    for normal in (sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)):
        if normal @ axes.forward >= 0:
            planes.append(normal @ basis / (near - normal @ np.asarray(eye, np.float64)))
    all_planes = np.array(planes)
    corners = np.array([(u, v, 1.0) for u in (-1, 1) for v in (-1, 1)]).T
    at_corners = all_planes @ corners
    ahead = int(np.argmax(all_planes[:, 2]))
    first: NDArray[np.bool_] = np.any(at_corners > at_corners[ahead], axis=1)
    first[ahead] = True
    return np.asarray(all_planes[first])


def inside(
    disparity: NDArray[np.floating], u: Floats, v: Floats, wall_planes: Floats
) -> NDArray[np.bool_]:
    """Whether points of `disparity` (n,) at (u, v) (n,), (n,) lie in the near cube: (n,) bool."""
    borders = wall_planes[:, :1] * u + wall_planes[:, 1:2] * v + wall_planes[:, 2:]
    return np.asarray(disparity > borders.max(axis=0))


def split(
    polygon: Floats, plane: Floats, wall_planes: Floats, resolution: int, cut: bool = False
) -> list[tuple[Floats, Floats]]:
    """Split a convex `polygon` (k, 2), texels, drawn on `plane` (3,) at the near border.

    Returns convex parts (polygon, plane) that cover it without overlap, most often itself alone;
    with `cut` only the parts outside the near field.
    """
    lines = np.array([texel_line(p, resolution) for p in wall_planes])
    own = texel_line(plane, resolution)
    dips = (polygon @ own[:2] + own[2])[:, None] > polygon @ lines[:, :2].T + lines[:, 2]
    if (~dips).all(axis=0).any():
        return [(polygon, plane)]
    parts = []
    within = polygon
    for line in lines:
        parts.append((_clip(within, line - own), plane))
        within = _clip(within, own - line)
    for k, line in enumerate(lines):
        part = np.zeros((0, 2)) if cut else within
        for other in np.delete(lines, k, axis=0):
            part = _clip(part, line - other)
        parts.append((part, wall_planes[k]))
    return [(part, p) for part, p in parts if len(part)]


def _clip(polygon: Floats, line: Floats) -> Floats:
    """Clip, dropping slivers: (m, 2) float, m = 0 or m >= 3."""
    if len(polygon) == 0:
        return polygon
    part = clip_half_plane(polygon, line)
    if len(part) < 3:
        return np.zeros((0, 2))
    x, y = (part - part[0]).T
    area = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    return part if area > SLIVER else np.zeros((0, 2))
