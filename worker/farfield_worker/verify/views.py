"""Which views of a cell are compared: centre, corners and random eyes, looking all around.

Corners show the greatest parallax that a bake must bear; the centre shows everything else it does
(texel size, cracks); random eyes are what a walker sees, and no bake is ever fitted to them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from farfield_core.faces import directions
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: how far inside the cell eyes stay, in parts of its half extent: each lies in one cell only
INSET = 1e-3


class Pose(NamedTuple):
    """Where a view is taken from: eye (3,) in scene coordinates, yaw and pitch in radians."""

    kind: str
    eye: Floats
    yaw: float
    pitch: float


def look(direction: Floats) -> tuple[float, float]:
    """Yaw and pitch, radians, of a direction (3,) of any length."""
    x, y, z = (float(c) for c in direction)
    return math.atan2(-x, -z), math.atan2(y, math.hypot(x, z))


def corners(half: Floats) -> Floats:
    """The eight corners of a cell around its centre, (8, 3), counting in binary."""
    signs = np.array([[(n >> axis & 1) * 2 - 1 for axis in range(3)] for n in range(8)])
    return np.asarray(signs * half, np.float64)


def poses(centre: Floats, half: Floats, faces: Sequence[int], count: int, seed: int) -> list[Pose]:
    """`count` poses in the cell around `centre` with half extents `half`, both (3,) metres.

    Every third pose is at a random eye, every third at the next corner, the rest at the centre and
    random eyes in turn, so that any `count` covers all kinds. Directions pass through `faces`, each
    as often, at random places. The same seed gives the same poses.
    """
    rng = np.random.default_rng(seed)
    inner = half * (1 - INSET)
    corner_order = rng.permutation(8)
    face_order = rng.permutation(np.asarray(faces))
    out = []
    for n in range(count):
        kind = ("centre" if n % 6 == 0 else "random", "corner", "random")[n % 3]
        if kind == "centre":
            offset = np.zeros(3)
        elif kind == "corner":
            offset = corners(inner)[corner_order[n // 3 % 8]]
        else:
            offset = rng.uniform(-inner, inner)
        # the shift by n // len(faces) keeps kinds of eyes and faces from falling into step
        u, v = rng.uniform(-1, 1, 2)
        direction = directions(
            int(face_order[(n + n // len(faces)) % len(faces)]), np.array(u), np.array(v)
        )
        out.append(Pose(kind, np.asarray(centre + offset, np.float64), *look(direction)))
    return out
