"""How far a single triangle reaches on a face: texels and disparities, always on the safe side.

Coordinates are those of the face's camera: X right, Y down, Z forward, metres; x = (X/Z + 1) R/2
and y alike are pixels, so texel (i, j) has its centre at (i + 1/2, j + 1/2).

The GPU snaps corners to a grid of 1/256 pixel (the GL specification asks for 1/16) and interpolates
in 32-bit floats. What is said here must hold for its idea of a triangle: texels are grown by `SNAP`
pixels, and disparities by what they change over `SNAP` pixels on the triangle's plane. Where a
triangle is too thin for the GPU's own gradients to be trusted its disparities are unbounded.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

#: Pixels by which the rasteriser's idea of a corner may differ from ours.
SNAP = 1.0 / 32.0
#: Relative rounding of a projected coordinate on the GPU, several float32 steps.
ROUNDING = 1e-6


@numba.njit(cache=True, error_model="numpy")
def slab_bounds(corners: Any, near: float, far: float, half: float, out: Any) -> bool:
    """Bounds in pixels of the part of a triangle with Z in [near, far], near > 0.

    `corners` is (3, 3), X, Y, Z of each; `half` is R/2. Writes x0, y0, x1, y1; False where nothing
    is left.
    """
    out[0] = out[1] = np.inf
    out[2] = out[3] = -np.inf
    for i in range(3):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        if near <= z <= far:
            out[0], out[2] = min(out[0], x / z), max(out[2], x / z)
            out[1], out[3] = min(out[1], y / z), max(out[3], y / z)
        j = (i + 1) % 3
        for plane in (near, far):
            if (z < plane) != (corners[j, 2] < plane):
                t = (plane - z) / (corners[j, 2] - z)
                u = (x + t * (corners[j, 0] - x)) / plane
                v = (y + t * (corners[j, 1] - y)) / plane
                out[0], out[2] = min(out[0], u), max(out[2], u)
                out[1], out[3] = min(out[1], v), max(out[3], v)
    for k in range(4):
        out[k] = (out[k] + 1.0) * half
    return bool(out[0] <= out[2])


@numba.njit(cache=True, error_model="numpy")
def texels_within(bounds: Any, resolution: int, out: Any) -> bool:
    """Texels whose centres lie within `bounds` (x0, y0, x1, y1, pixels) grown by SNAP.

    Writes the first column and row and those past the last; False where there are none.
    """
    for axis in range(2):
        first = np.ceil(max(bounds[axis] - SNAP - 0.5, 0.0))
        last = np.floor(min(bounds[axis + 2] + SNAP - 0.5, resolution - 1.0))
        if first > last:
            return False
        out[axis], out[axis + 2] = int(first), int(last) + 1
    return True


@numba.njit(cache=True, error_model="numpy")
def covers_any(screen: Any, texels: Any) -> bool:
    """Whether a triangle, grown by SNAP, holds the centre of any of `texels` (i0, j0, i1, j1).

    `screen` is (3, 2), pixels. Either winding will do: which one a sliver has is not certain.
    """
    for row in range(texels[1], texels[3]):
        for column in range(texels[0], texels[2]):
            left = right = True
            for i in range(3):
                j = (i + 1) % 3
                ex, ey = screen[j, 0] - screen[i, 0], screen[j, 1] - screen[i, 1]
                side = ex * (row + 0.5 - screen[i, 1]) - ey * (column + 0.5 - screen[i, 0])
                margin = SNAP * (abs(ex) + abs(ey) + SNAP)
                left, right = left and side >= -margin, right and side <= margin
            if left or right:
                return True
    return False


@numba.njit(cache=True, error_model="numpy")
def plane(corners: Any, out: Any) -> float:
    """Normal n of a triangle's plane, written to `out`, and n . p for its points p.

    The plane's disparity is n . (u, v, 1) / (n . p), and n . p is negative on the front.
    """
    x, y, z = corners[0, 0], corners[0, 1], corners[0, 2]
    ax, ay, az = corners[1, 0] - x, corners[1, 1] - y, corners[1, 2] - z
    bx, by, bz = corners[2, 0] - x, corners[2, 1] - y, corners[2, 2] - z
    out[0], out[1], out[2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return float(out[0] * x + out[1] * y + out[2] * z)


@numba.njit(cache=True, error_model="numpy")
def disparity_slack(
    corners: Any, screen: Any, resolution: int, normal: Any, offset: float
) -> float:
    """By how much a fragment's disparity may leave its triangle's range.

    `corners` (3, 3) and `screen` (3, 2) are of a triangle in front of the eye, `normal` and
    `offset` are those of `plane`.
    """
    z0, z1, z2 = corners[0, 2], corners[1, 2], corners[2, 2]
    length, reach = 0.0, 0.5 * resolution
    for i in range(3):
        j = (i + 1) % 3
        length += abs(screen[i, 0] - screen[j, 0]) + abs(screen[i, 1] - screen[j, 1])
        reach = max(reach, abs(screen[i, 0]), abs(screen[i, 1]))
    half = 0.5 * resolution
    area = abs(offset) * half * half / (z0 * z1 * z2)
    doubt = ROUNDING * reach * length / max(area, 1e-300)
    if doubt > 0.5:
        return np.inf
    gradient = (abs(normal[0]) + abs(normal[1])) / (half * abs(offset))
    least, greatest = 1.0 / max(z0, z1, z2), 1.0 / min(z0, z1, z2)
    return float(gradient * SNAP + (greatest - least) * doubt + 1e-5 * greatest)


@numba.njit(cache=True, error_model="numpy")
def clipped_slack(corners: Any, near: float, resolution: int, normal: Any, offset: float) -> float:
    """`disparity_slack` of a triangle that the near clip plane cuts.

    The clipper's new corners are rounded too, and edge-on its triangles are slivers.
    """
    reach = np.sqrt((normal * normal).sum() * (corners * corners).sum())
    if not abs(offset) > 1e-3 * reach:
        return np.inf
    gradient = (abs(normal[0]) + abs(normal[1])) / (0.5 * resolution * abs(offset))
    return float(gradient * SNAP + 0.01 / near)
