"""Random triangles seen by casting one ray per texel: the plainest A-buffer there is."""

from typing import NamedTuple

import numpy as np
from farfield_core.faces import directions, texel_centres
from farfield_core.placement import default_alpha
from farfield_worker.slanted.planes import TrianglePlanes, triangle_planes
from farfield_worker.slanted.tolerance import Tolerance
from numpy.typing import NDArray

Floats = NDArray[np.float64]
HALF = (5.0, 4.0, 6.0)
NEAR = 20.0
RESOLUTION = 48
ALPHA = default_alpha(RESOLUTION)


class Seen(NamedTuple):
    """Fragments of one face, sorted by texel, nearest first, and what they come from."""

    face: int
    eye: Floats
    corners: Floats
    texel: NDArray[np.int32]
    disparity: Floats
    seed: NDArray[np.int32]
    triangles: TrianglePlanes
    tolerance: Tolerance


def random_corners(rng: np.random.Generator, count: int) -> Floats:
    """Triangles (count, 3, 3) around the origin, some of them large, some parallel pairs."""
    centre = rng.uniform(-1, 1, (count, 1, 3)) * rng.choice([30.0, 80.0, 300.0], (count, 1, 1))
    size = rng.uniform(2, 40, (count, 1, 1))
    corners = centre + rng.normal(size=(count, 3, 3)) * size
    corners[::4] = corners[0] + rng.normal(size=(len(corners[::4]), 1, 3))
    return corners


def cast(
    face: int, eye: Floats, corners: Floats, resolution: int = RESOLUTION, near: float = NEAR
) -> Seen:
    """All hits of the rays through texel centres outside the near cube around the origin."""
    c = texel_centres(resolution)
    u, v = np.meshgrid(c, c)
    rays = directions(face, u, v).reshape(-1, 3)
    triangles = triangle_planes(face, eye, corners)
    texel, disparity, seed = [], [], []
    for k, corner in enumerate(corners - eye):
        sides = np.stack([rays @ np.cross(corner[i], corner[(i + 1) % 3]) for i in range(3)])
        a, b, c0 = triangles.plane[k]
        d = a * u.ravel() + b * v.ravel() + c0
        hit = ((sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)) & (d > 0)
        hit[hit] = np.abs(eye + rays[hit] / d[hit, None]).max(axis=1) >= near
        texel.append(np.flatnonzero(hit))
        disparity.append(d[hit])
        seed.append(np.full(hit.sum(), k))
    t, d, s = (np.concatenate(x) for x in (texel, disparity, seed))
    order = np.lexsort((s, -d, t))
    tolerance = Tolerance.of(face, eye, HALF, ALPHA, near)
    return Seen(
        face,
        eye,
        corners,
        t[order].astype(np.int32),
        d[order],
        s[order].astype(np.int32),
        triangles,
        tolerance,
    )
