"""From surfaces to triangles: each becomes a grid of as many cells as its level asks for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.land import land_height
from farfield_worker.demo.surfaces import Floats, Kind, Surfaces

Counts = NDArray[np.int64]

#: outlines of lathes: (radius, height) in parts of the whole, from the foot to the rim
PROFILES = (
    ((1.0, 0.0), (1.0, 1.0)),  # 0: drum
    ((1.0, 0.0), (0.02, 1.0)),  # 1: cone
    ((0.55, 0.0), (0.95, 0.3), (1.0, 0.5), (0.8, 0.8), (0.5, 0.92), (0.62, 1.0)),  # 2: pot
    ((1.0, 0.0), (0.97, 0.3), (0.85, 0.6), (0.55, 0.88), (0.03, 1.0)),  # 3: dome
    ((1.0, 0.0), (0.7, 0.15), (0.6, 0.5), (0.75, 0.85), (1.0, 1.0)),  # 4: brazier
    ((1.0, 0.0), (0.75, 0.35), (0.62, 1.0)),  # 5: trunk
    ((0.5, 0.0), (1.0, 0.35), (0.8, 0.7), (0.05, 1.0)),  # 6: flame
    ((0.02, 0.0), (1.0, 1.0)),  # 7: underside of a wide roof
    ((1.0, 0.0), (0.1, 1.0)),  # 8: lid
)
_KNOTS = 13


class Mesh(NamedTuple):
    """Triangles of some surfaces.

    Attributes:
        positions: (n, 3) float64, whole multiples of 1/1024 m.
        normals: (n, 3) float64, unit.
        uvs: (n, 2) float64.
        row: (n,) int64, the surface that each vertex belongs to.
        triangles: (m, 3) uint32.
    """

    positions: Floats
    normals: Floats
    uvs: Floats
    row: Counts
    triangles: NDArray[np.uint32]


def divisions(table: Surfaces, level: float) -> tuple[Counts, Counts]:
    """Cells along u and v of every surface at `level`; zero where it does not exist there."""
    least = np.where(table.kind == Kind.LATHE, 5, np.where(table.kind == Kind.HULL, 2, 1))
    nu = np.maximum(np.floor(table.segments[:, 0] * level + table.rank[:, 0]), least)
    nv = np.maximum(np.floor(table.segments[:, 1] * level + table.rank[:, 1]), 1)
    nv = np.where(table.kind == Kind.HULL, np.maximum(nv, 2), nv)
    here = (table.levels[:, 0] <= level) & (level < table.levels[:, 1])
    return (nu * here).astype(np.int64), (nv * here).astype(np.int64)


def triangle_count(table: Surfaces, level: float) -> int:
    """Triangles of the table at `level`."""
    nu, nv = divisions(table, level)
    return int(2 * (nu * nv).sum())


def tessellate(table: Surfaces, nu: Counts, nv: Counts) -> Mesh:
    """Cut surfaces, all with nu, nv >= 1, into triangles that wind counter-clockwise."""
    row, u, v, step = _grid(nu, nv)
    positions = _positions(table, row, u, v)
    rough = table.rough[row]
    uneven = np.flatnonzero(rough > 0)
    if len(uneven):
        positions[uneven] += unevenness(positions[uneven]) * rough[uneven, None]
    normals = _normals(positions, row, u, v, step, nu, nv)
    cards = np.flatnonzero(table.kind[row] == Kind.CARD)
    if len(cards):
        normals[cards] = _bent(normals[cards], positions[cards], table.extra[row[cards]])
    frame = table.uv[row]
    uvs = frame[:, 0] + u[:, None] * frame[:, 1] + v[:, None] * frame[:, 2]
    positions = np.rint(positions * 1024.0) / 1024.0
    return Mesh(positions, normals, uvs, row, _triangles(nu, nv))


def _grid(nu: Counts, nv: Counts) -> tuple[Counts, Floats, Floats, Counts]:
    vertices = (nu + 1) * (nv + 1)
    row = np.repeat(np.arange(len(nu)), vertices)
    local = np.arange(len(row)) - np.repeat(np.cumsum(vertices) - vertices, vertices)
    step = (nu + 1)[row]
    j = local // step
    i = local - j * step
    return row, i / nu[row], j / nv[row], step


def _triangles(nu: Counts, nv: Counts) -> NDArray[np.uint32]:
    cells = nu * nv
    row = np.repeat(np.arange(len(nu)), cells)
    local = np.arange(len(row)) - np.repeat(np.cumsum(cells) - cells, cells)
    vertices = (nu + 1) * (nv + 1)
    width = nu[row]
    j = local // width
    i = local - j * width
    a = (np.cumsum(vertices) - vertices)[row] + j * (width + 1) + i
    b, c, d = a + 1, a + width + 2, a + width + 1
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.uint32)


def _positions(table: Surfaces, row: Counts, u: Floats, v: Floats) -> Floats:
    kind = table.kind[row]
    out = np.empty((len(row), 3))
    flat = np.flatnonzero((kind != Kind.LATHE) & (kind != Kind.HULL))
    r, s, t = row[flat], u[flat, None], v[flat, None]
    shape = table.shape
    out[flat] = ((1 - s) * shape[r, 0] + s * shape[r, 1]) * (1 - t) + (
        (1 - s) * shape[r, 3] + s * shape[r, 2]
    ) * t
    sagging = np.flatnonzero(kind == Kind.SAGGING)
    if len(sagging):
        s = u[sagging]
        bow = 4 * s * (1 - s) * v[sagging]
        out[sagging] += table.extra[row[sagging]] * bow[:, None]
    land = np.flatnonzero(kind == Kind.LAND)
    if len(land):
        out[land, 1] = land_height(out[land, 0], out[land, 2])
    lathes = np.flatnonzero(kind == Kind.LATHE)
    if len(lathes):
        out[lathes] = _lathe(table.shape[row[lathes]], u[lathes], v[lathes])
    hulls = np.flatnonzero(kind == Kind.HULL)
    if len(hulls):
        out[hulls] = _hull(table.shape[row[hulls]], u[hulls], v[hulls])
    return out


def _profile_table() -> Floats:
    t = np.linspace(0.0, 1.0, _KNOTS)
    rows = []
    for profile in PROFILES:
        knots = np.linspace(0.0, 1.0, len(profile))
        radius, height = zip(*profile, strict=True)
        rows.append(np.stack([np.interp(t, knots, radius), np.interp(t, knots, height)], axis=1))
    return np.array(rows)


_PROFILE_TABLE = _profile_table()


def _lathe(shape: Floats, u: Floats, v: Floats) -> Floats:
    radius, height, profile = shape[:, 1, 0], shape[:, 1, 1], shape[:, 1, 2].astype(np.int64)
    knot = np.minimum((v * (_KNOTS - 1)).astype(np.int64), _KNOTS - 2)
    part = (v * (_KNOTS - 1) - knot)[:, None]
    here, there = _PROFILE_TABLE[profile, knot], _PROFILE_TABLE[profile, knot + 1]
    outline = here * (1 - part) + there * part
    angle = np.where(u < 1.0, u, 0.0) * (2 * np.pi)  # the seam closes exactly
    reach = radius * outline[:, 0]
    offset = [reach * np.cos(angle), height * outline[:, 1], -reach * np.sin(angle)]
    return np.asarray(shape[:, 0] + np.stack(offset, axis=1))


def _hull(shape: Floats, u: Floats, v: Floats) -> Floats:
    draught, rise = shape[:, 3, 0], shape[:, 3, 1]
    along, across = 2 * u - 1, 2 * v - 1
    along = along * (1.5 - 0.5 * along * along)  # closer together towards the ends
    end = along * along
    half = np.sqrt(np.maximum(1 - end * end, 0.0)) * 0.97 + 0.03
    keel = -draught * (1 - across * across) * half
    sheer = rise * (0.6 + 0.9 * end * end)
    out = shape[:, 0] + shape[:, 1] * along[:, None] + shape[:, 2] * (across * half)[:, None]
    out[:, 1] += np.maximum(keel, -draught * 0.9) + sheer
    return np.asarray(out)


def _wave(x: Floats) -> Floats:
    """Periodic over 1, in [-1, 1], smooth: two parabolas in place of a sine."""
    x = x - np.floor(x)
    y = 16.0 * x * (0.5 - x)
    return np.where(x < 0.5, y, 16.0 * (x - 0.5) * (x - 1.0))


def unevenness(p: Floats) -> Floats:
    """A smooth field of vectors of about unit length over space, (n, 3) -> (n, 3) float."""
    x, y, z = p[:, 0], p[:, 1], p[:, 2]
    return np.stack(
        [
            0.6 * _wave(0.23 * y + 0.31 * z + 0.05 * x) + 0.4 * _wave(0.61 * y - 0.47 * z),
            0.6 * _wave(0.29 * x - 0.27 * z + 0.3) + 0.4 * _wave(0.53 * x + 0.59 * z + 0.1 * y),
            0.6 * _wave(0.25 * y + 0.28 * x + 0.7) + 0.4 * _wave(0.57 * y - 0.51 * x + 0.2),
        ],
        axis=1,
    )


def _normals(
    p: Floats, row: Counts, u: Floats, v: Floats, step: Counts, nu: Counts, nv: Counts
) -> Floats:
    """Unit normals by differences between grid neighbours."""
    index = np.arange(len(row))
    right = np.where(u < 1.0, index + 1, index)
    left = np.where(u > 0.0, index - 1, index)
    above = np.where(v < 1.0, index + step, index)
    below = np.where(v > 0.0, index - step, index)
    along, up = p[right] - p[left], p[above] - p[below]
    normal = np.stack(
        [
            along[:, 1] * up[:, 2] - along[:, 2] * up[:, 1],
            along[:, 2] * up[:, 0] - along[:, 0] * up[:, 2],
            along[:, 0] * up[:, 1] - along[:, 1] * up[:, 0],
        ],
        axis=1,
    )
    return _unit(normal)


def _unit(v: Floats) -> Floats:
    square = v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1] + v[:, 2] * v[:, 2]
    return np.asarray(v / np.sqrt(np.maximum(square, 1e-30))[:, None])


def _bent(normals: Floats, positions: Floats, centre: Floats) -> Floats:
    """Normals of foliage: mostly away from the crown's middle, so that the crown shades as one."""
    return _unit(0.35 * normals + _unit(positions - centre))
