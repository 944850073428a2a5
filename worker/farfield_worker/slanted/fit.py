"""Least squares fit of a disparity plane, in units of tolerance."""

from __future__ import annotations

from typing import Any

from numba import njit

from farfield_worker.slanted.grid import match


@njit(cache=True)
def fit_plane(grid: Any, rect: Any, plane: Any, out: Any) -> bool:
    """Refit `plane` to the fragments it may draw inside `rect`; write to `out` (3,).

    Minimises the sum of ((d - d') / (width of d's interval))^2 over texels, d' the plane's value.
    False where the texels do not determine a plane. Coordinates are taken from the middle of the
    rectangle in units of its size; about the weighted means only two normal equations remain.
    """
    size = 2.0 / grid.resolution
    mx = ((rect[0] + rect[2]) * 0.5) * size - 1.0
    my = ((rect[1] + rect[3]) * 0.5) * size - 1.0
    extent = max(rect[2] - rect[0], rect[3] - rect[1]) * size
    w = wx = wy = wd = wxx = wxy = wyy = wxd = wyd = 0.0
    for row in range(rect[1], rect[3]):
        for column in range(rect[0], rect[2]):
            f = match(grid, column, row, plane[0], plane[1], plane[2])
            if f < 0:
                continue
            x = ((column + 0.5) * size - 1.0 - mx) / extent
            y = ((row + 0.5) * size - 1.0 - my) / extent
            d = grid.disparity[f]
            weight = 1.0 / (grid.high[f] - grid.low[f]) ** 2
            w += weight
            wx, wy, wd = wx + weight * x, wy + weight * y, wd + weight * d
            wxx, wxy, wyy = wxx + weight * x * x, wxy + weight * x * y, wyy + weight * y * y
            wxd, wyd = wxd + weight * x * d, wyd + weight * y * d
    if w == 0.0:
        return False
    xx, xy, yy = wxx / w - (wx / w) ** 2, wxy / w - wx * wy / w**2, wyy / w - (wy / w) ** 2
    xd, yd = wxd / w - wx * wd / w**2, wyd / w - wy * wd / w**2
    determinant = xx * yy - xy * xy
    if determinant < 1e-6:
        return False
    a, b = (xd * yy - yd * xy) / determinant, (yd * xx - xd * xy) / determinant
    out[0], out[1] = a / extent, b / extent
    out[2] = (wd - a * wx - b * wy) / w - out[0] * mx - out[1] * my
    return True
