"""The six faces of a layer cube and their coordinates (u, v) and disparity d.

A point p seen from eye e on a face with axes (right, down, forward) has, with q = p - e,

    Z = q . forward        u = (q . right) / Z        v = (q . down) / Z        d = 1 / Z

so the direction through (u, v) is forward + u right + v down, u and v run over [-1, 1], and the
homogeneous point (direction(u, v) + d e, d) is p / Z: linear in (u, v, 1) on any plane of affine
disparity. `right`, `down`, `forward` are right-handed, as in a camera whose image rows go down.
Texel (column, row) of a face of R texels has its centre at u = (2 column + 1) / R - 1,
v = (2 row + 1) / R - 1; row 0 is the top row of the picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Face(NamedTuple):
    """One face: its name and axes, each (3,) float, unit and mutually orthogonal."""

    name: str
    right: Floats
    down: Floats
    forward: Floats


def _face(name: str, forward: tuple[int, int, int], down: tuple[int, int, int]) -> Face:
    f, w = np.array(forward, np.float64), np.array(down, np.float64)
    return Face(name, np.cross(w, f), w, f)


#: Index in this tuple is the face number of the file format.
FACES: tuple[Face, ...] = (
    _face("+x", (1, 0, 0), (0, -1, 0)),
    _face("-x", (-1, 0, 0), (0, -1, 0)),
    _face("+y", (0, 1, 0), (0, 0, 1)),
    _face("-y", (0, -1, 0), (0, 0, -1)),
    _face("+z", (0, 0, 1), (0, -1, 0)),
    _face("-z", (0, 0, -1), (0, -1, 0)),
)

SIDES: tuple[int, ...] = (0, 1, 4, 5)
ALL: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


def directions(face: int, u: Floats, v: Floats) -> Floats:
    """Directions through face coordinates (...): (..., 3) float, of length 1 along forward."""
    _, right, down, forward = FACES[face]
    return (
        forward
        + np.asarray(u, np.float64)[..., None] * right
        + np.asarray(v, np.float64)[..., None] * down
    )


def project(face: int, eye: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return (u, v, Z) of `points` (..., 3) seen from `eye` (3,); u, v are inf or nan at Z = 0."""
    _, right, down, forward = FACES[face]
    q = np.asarray(points, np.float64) - np.asarray(eye, np.float64)
    z = q @ forward
    with np.errstate(divide="ignore", invalid="ignore"):
        return (q @ right) / z, (q @ down) / z, z


def texel_centres(resolution: int) -> Floats:
    """Face coordinate of each texel's centre along one axis, (resolution,) float."""
    return (2.0 * np.arange(resolution, dtype=np.float64) + 1.0) / resolution - 1.0
