"""Ground, quays, water and hills: the map of classes as surfaces.

Floors exist twice: coarse ones, large rectangles that run on under the houses, and fine ones that
follow every court. Each tile of two by two blocks changes over at a level of its own.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.hashing import uniform
from farfield_worker.demo.land import EXTENT, land_height
from farfield_worker.demo.layout import HALF, HEIGHTS, PITCH, Ground, Layout
from farfield_worker.demo.looks import EARTH, LIME, PAVING, STONE, TILE, Look, Material, rgb
from farfield_worker.demo.surfaces import ENDLESS, Floats, Kind, Surfaces, concatenate, linear

Classes = NDArray[np.uint8]
Rows = NDArray[np.int64]

_FINE, _COARSE = 14, 2 * PITCH
#: first tile border: block borders are borders of tiles
_START = HALF % PITCH

_LOOKS: dict[int, Look] = {
    Ground.STREET: EARTH.tinted(*rgb("dccaa8")),
    Ground.AVENUE: PAVING,
    Ground.PLAZA: PAVING.tinted(*rgb("eee2c8")),
    Ground.MARKET: PAVING.tinted(*rgb("dcc8a2")),
    Ground.COURT: EARTH.tinted(*rgb("e2cca8")),
    Ground.CAUSEWAY: PAVING.tinted(*rgb("d6c6a6")),
    Ground.CHINAMPA: EARTH.tinted(*rgb("9a7e56")),
    Ground.LANE: LIME.tinted(*rgb("b4583e"))._replace(grain=0.2),
    Ground.GARDEN: Look(Material.GRASS, rgb("a8b068"), grain=0.4),
}


def rectangles(classes: Classes, tile: int) -> Rows:
    """Cut the map into rectangles of one class each that cross no border of a tile.

    Returns:
        (n, 5) int: x0, z0, x1, z1 in cells, class.
    """
    size = len(classes)
    lines = [0, *range(_START, size, tile), size]
    spans = list(pairwise(lines))
    rows = []
    for z0, z1 in spans:
        for x0, x1 in spans:
            area = classes[z0:z1, x0:x1]
            us = _cuts((area[:, 1:] != area[:, :-1]).any(axis=0))
            vs = _cuts((area[1:] != area[:-1]).any(axis=1))
            small = area[np.ix_(vs, us)]
            us.append(x1 - x0)
            vs.append(z1 - z0)
            rows += [
                (x0 + us[a], z0 + vs[b], x0 + us[c], z0 + vs[d], kind)
                for a, b, c, d, kind in _greedy(small)
            ]
    return np.array(rows, np.int64)


def _cuts(changes: NDArray[np.bool_]) -> list[int]:
    return [0, *(int(k) + 1 for k in np.flatnonzero(changes))]


def _greedy(grid: Classes) -> list[tuple[int, int, int, int, int]]:
    """Rectangles of equal cells, each as wide as it goes, then as high."""
    cells: list[list[int]] = grid.tolist()
    height, width = grid.shape
    out = []
    for z in range(height):
        for x in range(width):
            kind = cells[z][x]
            if kind < 0:
                continue
            x1 = x
            while x1 < width and cells[z][x1] == kind:
                x1 += 1
            z1 = z + 1
            while z1 < height and all(c == kind for c in cells[z1][x:x1]):
                z1 += 1
            for row in cells[z:z1]:
                row[x:x1] = [-1] * (x1 - x)
            out.append((x, z, x1, z1, kind))
    return out


def heights(classes: Classes, cell: float) -> NDArray[np.float32]:
    """Heights of the ground, (size, size) float32, with map cells of `cell` metres."""
    table = np.array(HEIGHTS, np.float32)[classes]
    factor = round(1 / cell)
    fine = np.repeat(np.repeat(table, factor, axis=0), factor, axis=1)
    middle = (np.arange(0, len(fine), 4) + 2) * cell - EXTENT
    x, z = np.meshgrid(middle, middle)
    land = land_height(x.ravel(), z.ravel()).reshape(x.shape).astype(np.float32)
    land = np.repeat(np.repeat(land, 4, axis=0), 4, axis=1)[: len(fine), : len(fine)]
    return np.maximum(fine, land)


def floors(layout: Layout) -> Surfaces:
    """Streets, squares, courts, gardens and causeways; fine ones lie on an underlay that shows
    through no pinhole as sky.
    """
    simple = layout.classes.copy()
    simple[(simple == Ground.BUILT) | (simple == Ground.COURT)] = Ground.STREET
    coarse = _dry(rectangles(simple, _COARSE))
    fine = _dry(rectangles(layout.classes, _FINE))
    fine = fine[fine[:, 4] != Ground.BUILT]
    parts = []
    for kind, look in _LOOKS.items():
        for rows, early in ((coarse, True), (fine, False)):
            chosen = rows[rows[:, 4] == kind]
            change = _changeover(chosen)
            levels = (0.0 * change, change) if early else (change, change * 0 + ENDLESS)
            parts.append(_level(chosen, HEIGHTS[kind], look, np.stack(levels, axis=1)))
    change = _changeover(coarse)
    under = np.stack([change, change * 0 + ENDLESS], axis=1)
    parts.append(_level(coarse, 0.3, EARTH._replace(grain=0.0), under))
    return concatenate(parts)


def _dry(rows: Rows) -> Rows:
    return rows[rows[:, 4] > Ground.CANAL]


def _changeover(rows: Rows) -> Floats:
    """The level at which the tile of each rectangle becomes fine."""
    tile = (rows[:, :2] - _START) // _COARSE
    return 0.22 + 0.2 * uniform(32, tile[:, 0], tile[:, 1])


def _level(rows: Rows, y: float, look: Look, levels: Floats) -> Surfaces:
    x0, z0, x1, z1 = ((rows[:, k] - HALF).astype(np.float64) for k in range(4))
    return _table(_flat(x0, z0, x1, z1, y), look, np.stack([x1 - x0, z1 - z0], axis=1), levels)


def _flat(x0: Floats, z0: Floats, x1: Floats, z1: Floats, y: float) -> Floats:
    level = np.full(len(x0), y)
    corners = ((x0, z1), (x1, z1), (x1, z0), (x0, z0))
    return np.stack([np.stack([x, level, z], axis=1) for x, z in corners], axis=1)


def quays(layout: Layout) -> Surfaces:
    """Walls wherever the ground steps down, at the water at all levels, elsewhere at fine ones."""
    height = np.array(HEIGHTS)[layout.classes]
    wet = layout.classes <= Ground.CANAL
    walls: list[tuple[float, ...]] = []
    for vertical in (True, False):
        a, w = (height, wet) if vertical else (height.T, wet.T)
        for side in (1, -1):  # 1: the ground is higher before the line, -1: behind it
            low, high = (a[:, 1:], a[:, :-1]) if side == 1 else (a[:, :-1], a[:, 1:])
            under = w[:, 1:] if side == 1 else w[:, :-1]
            step = high > low + 1e-6
            for k in np.flatnonzero(step.any(axis=0)):
                key = np.where(step[:, k], high[:, k] * 64 + low[:, k], -1.0)
                bounds = [*_cuts(np.diff(key) != 0), len(key)]
                for start, stop in pairwise(bounds):
                    if key[start] < 0:
                        continue
                    water = bool(under[start, k])
                    foot = -0.5 if water else float(low[start, k]) - 0.3
                    longest = PITCH if water else _FINE
                    for s in range(start, stop, longest):
                        e = min(s + longest, stop)
                        top = float(high[start, k])
                        walls.append((vertical, side, int(k) + 1, s, e, foot, top, water))
    return _walls(np.array(walls))


def _walls(w: Floats) -> Surfaces:
    vertical, side = w[:, 0] > 0, w[:, 1]
    line, start, stop = (w[:, k] - HALF for k in (2, 3, 4))
    # u runs to the right of who looks at the wall from the low side
    forward = np.where(vertical, side < 0, side > 0)
    a, b = np.where(forward, start, stop), np.where(forward, stop, start)
    foot, top = w[:, 5], w[:, 6]
    shape = np.empty((len(w), 4, 3))
    for corner, (along, y) in enumerate(((a, foot), (b, foot), (b, top), (a, top))):
        shape[:, corner, 0] = np.where(vertical, line, along)
        shape[:, corner, 1] = y
        shape[:, corner, 2] = np.where(vertical, along, line)
    levels = np.stack([np.where(w[:, 7] > 0, 0.0, 0.3), np.full(len(w), ENDLESS)], axis=1)
    sizes = np.stack([stop - start, top - foot], axis=1)
    return _table(shape, STONE.tinted(*rgb("d4c5a6")), sizes, levels)


def _table(shape: Floats, look: Look, sizes: Floats, levels: Floats) -> Surfaces:
    n = len(shape)
    tile = TILE[look.material]
    uv = np.zeros((n, 3, 2))
    rising = shape[:, 2, 1] > shape[:, 0, 1]
    uv[:, 0, 0] = np.where(rising, 0.0, shape[:, 0, 0] / tile)
    uv[:, 0, 1] = np.where(rising, -shape[:, 0, 1], shape[:, 0, 2]) / tile
    uv[:, 1, 0] = sizes[:, 0] / tile
    uv[:, 2, 1] = -sizes[:, 1] / tile
    key = np.rint(shape[:, 0] * 8).astype(np.int64)
    return Surfaces(
        kind=np.full(n, Kind.FLAT, np.uint8),
        shape=shape,
        extra=np.zeros((n, 3)),
        uv=uv,
        material=np.full(n, look.material, np.uint8),
        tint=np.tile(linear(look.tint), (n, 1)),
        rough=np.zeros(n),
        segments=sizes * look.grain,
        rank=uniform(31, key[:, 0, None], key[:, 1, None], key[:, 2, None], [[0, 1]]),
        levels=levels,
    )


def water(layout: Layout) -> Surfaces:
    """One level surface in patches; patches without any water are left out."""
    count = 24
    cell = 2 * EXTENT / count
    i, j = (k.ravel().astype(np.float64) for k in np.meshgrid(np.arange(count), np.arange(count)))
    x0, z0 = i * cell - EXTENT, j * cell - EXTENT
    wet = layout.classes <= Ground.CANAL
    corners = zip((x0 + HALF).astype(int).tolist(), (z0 + HALF).astype(int).tolist(), strict=True)
    span = int(cell) + 2
    keep = np.array([wet[b : b + span, a : a + span].any() for a, b in corners])
    keep &= _samples(x0, z0, cell).min(axis=1) < 0
    x0, z0 = x0[keep], z0[keep]
    look = Look(Material.WATER, grain=0.12)
    sizes = np.full((len(x0), 2), cell)
    levels = np.tile([0.0, ENDLESS], (len(x0), 1))
    table = _table(_flat(x0, z0, x0 + cell, z0 + cell, 0.0), look, sizes, levels)
    return _conforming(table, x0, z0)


def _samples(x: Floats, z: Floats, cell: float) -> Floats:
    """Heights of the land at 36 points of each patch, (n, 36) float."""
    a, b = (k.ravel()[None] for k in np.meshgrid(np.linspace(0, cell, 6), np.linspace(0, cell, 6)))
    xs, zs = x[:, None] + a, z[:, None] + b
    return land_height(xs.ravel(), zs.ravel()).reshape(xs.shape)


def land() -> Surfaces:
    """The shore and the hills."""
    cell = 45.0
    count = int(2 * EXTENT / cell)
    i, j = (k.ravel().astype(np.float64) for k in np.meshgrid(np.arange(count), np.arange(count)))
    x0, z0 = i * cell - EXTENT, j * cell - EXTENT
    keep = _samples(x0, z0, cell).max(axis=1) > -0.8
    x0, z0 = x0[keep], z0[keep]
    look = Look(Material.GRASS, grain=0.13)
    sizes = np.full((len(x0), 2), cell)
    levels = np.tile([0.0, ENDLESS], (len(x0), 1))
    table = _table(_flat(x0, z0, x0 + cell, z0 + cell, 0.0), look, sizes, levels)
    table.kind[:] = Kind.LAND
    return _conforming(table, x0, z0)


def _conforming(table: Surfaces, x: Floats, z: Floats) -> Surfaces:
    """Give patches of a lattice ranks by column and row: neighbours share edges without cracks."""
    table.rank[:, 0] = uniform(33, np.rint(x).astype(np.int64))
    table.rank[:, 1] = uniform(34, np.rint(z).astype(np.int64))
    return table
