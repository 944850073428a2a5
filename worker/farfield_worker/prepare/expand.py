"""Instances expanded to triangles in scene space: bounds, centroids and welded blocks."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.assembly import Assembly


def bounds(assembly: Assembly) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest corner of everything drawn, (3,) float each, scene coordinates."""
    a = assembly
    box = _bounds(a.positions, a.corners, a.first, a.drawn, a.linear, a.shift)
    return box[0], box[1]


def centroids(assembly: Assembly, origin: NDArray[np.float64]) -> NDArray[np.float32]:
    """Centroid of every drawn triangle relative to `origin`, (t, 3) float32."""
    a = assembly
    out = np.empty((a.triangles, 3), np.float32)
    _centroids(a.positions, a.corners, a.first, a.drawn, a.linear, a.shift - origin, out)
    return out


@numba.njit(cache=True, nogil=True)
def _bounds(positions, corners, first, drawn, linear, shift) -> Any:  # type: ignore[no-untyped-def]
    box = np.empty((2, 3))
    box[0] = np.inf
    box[1] = -np.inf
    for k in range(len(first)):
        for t in range(first[k], first[k] + drawn[k + 1] - drawn[k]):
            for c in range(3):
                v = corners[t, c]
                for axis in range(3):
                    x = shift[k, axis]
                    for i in range(3):
                        x += linear[k, axis, i] * positions[v, i]
                    box[0, axis] = min(box[0, axis], x)
                    box[1, axis] = max(box[1, axis], x)
    return box


@numba.njit(cache=True, nogil=True)
def _centroids(positions, corners, first, drawn, linear, shift, out) -> None:  # type: ignore[no-untyped-def]
    for k in range(len(first)):
        for n in range(drawn[k + 1] - drawn[k]):
            t = first[k] + n
            for axis in range(3):
                x = 0.0
                for i in range(3):
                    total = 0.0
                    for c in range(3):
                        total += positions[corners[t, c], i]
                    x += linear[k, axis, i] * total
                out[drawn[k] + n, axis] = x / 3.0 + shift[k, axis]
