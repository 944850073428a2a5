"""Which way up a model is, and in which unit: what was said, and what it looks like.

glTF fixes both (y up, metres); OBJ, PLY and STL fix neither. Nothing is turned by itself: a guess
is told, and whoever uploaded the model decides.
"""

from __future__ import annotations

from typing import Any, Literal

import numba
import numpy as np
from farfield_core.scene import Suspicion
from numpy.typing import NDArray

from farfield_worker.prepare.assembly import Assembly

#: z faces up if surfaces across it have this many times the area of those across y
_SURELY = 1.6
#: heights of rooms and buildings lie below this many metres, and above that share of their width
_TALLEST = 900.0
_FLATTEST = 0.02
#: what is larger than this is taken for millimetres rather than centimetres
_MILLIMETRES = 5000.0
#: triangles looked at
_SAMPLE = 200_000


def upright_matrix(up: Literal["y", "z"], scale: float) -> NDArray[np.float64]:
    """(4, 4) float, the model's coordinates to metres with y up."""
    turn = np.eye(4)
    if up == "z":  # (x, y, z) -> (x, z, -y)
        turn[1:3, 1:3] = [[0.0, 1.0], [-1.0, 0.0]]
    turn[:3] *= scale
    return turn


def guess_orientation(
    assembly: Assembly, low: NDArray[np.float64], high: NDArray[np.float64], suffix: str
) -> Suspicion | None:
    """What a model that was read as it is seems to be; None where it seems right.

    Floors, roofs and ground lie flat, so the upward axis has the greatest area across it. A
    building over a kilometre high is taken for one in centimetres or millimetres.
    """
    tipped = False
    if suffix.lower() not in (".glb", ".gltf"):
        area = _areas(assembly)
        tipped = bool(area[2] > _SURELY * area[1])
    extent = high - low
    height = extent[2] if tipped else extent[1]
    scale = 1.0
    if height > _TALLEST and height > _FLATTEST * extent.max():
        scale = 0.001 if extent.max() > _MILLIMETRES else 0.01
    return Suspicion(up="z" if tipped else "y", scale=scale) if tipped or scale != 1.0 else None


def _areas(assembly: Assembly) -> NDArray[np.float64]:
    """(3,) float, area of all surfaces as seen along x, y and z."""
    a = assembly
    step = max(1, a.triangles // _SAMPLE)
    out: NDArray[np.float64] = _seen(a.positions, a.corners, a.first, a.drawn, a.linear, step)
    return out


@numba.njit(cache=True, nogil=True)
def _seen(positions, corners, first, drawn, linear, step) -> Any:  # type: ignore[no-untyped-def]
    area = np.zeros(3)
    edges = np.empty((2, 3))
    for k in range(len(first)):
        # so that many small instances are not all left out
        for t in range((k % step), drawn[k + 1] - drawn[k], step):
            corner = corners[first[k] + t]
            for e in range(2):
                for axis in range(3):
                    x = 0.0
                    for i in range(3):
                        x += linear[k, axis, i] * (
                            positions[corner[e + 1], i] - positions[corner[0], i]
                        )
                    edges[e, axis] = x
            for axis in range(3):
                p, q = (axis + 1) % 3, (axis + 2) % 3
                area[axis] += abs(edges[0, p] * edges[1, q] - edges[0, q] * edges[1, p])
    return area
