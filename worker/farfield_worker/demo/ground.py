"""Ground, quays and water: the map of classes as surfaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.hashing import uniform
from farfield_worker.demo.land import EXTENT, land_height
from farfield_worker.demo.layout import HALF, HEIGHTS, Ground, Layout
from farfield_worker.demo.looks import EARTH, PAVING, STONE, TILE, Look, Material, rgb
from farfield_worker.demo.surfaces import ENDLESS, Floats, Kind, Surfaces, linear

Classes = NDArray[np.uint8]
_TILE = 14

_LOOKS: dict[int, Look] = {
    Ground.STREET: EARTH.tinted(*rgb("d8c6a6")),
    Ground.AVENUE: PAVING,
    Ground.PLAZA: PAVING.tinted(*rgb("eadfc8")),
    Ground.MARKET: PAVING.tinted(*rgb("d9c5a0")),
    Ground.COURT: EARTH.tinted(*rgb("dcc8a8")),
    Ground.CAUSEWAY: PAVING.tinted(*rgb("d2c3a4")),
    Ground.CHINAMPA: EARTH.tinted(*rgb("8c7450")),
    Ground.GARDEN: Look(Material.GRASS, rgb("cfd0a8"), grain=0.4),
}
_WATER = Look(Material.WATER, rgb("ffffff"), grain=0.12)


def rectangles(classes: Classes) -> NDArray[np.int64]:
    """Cut the map into rectangles of one class each, at most a tile wide.

    Returns:
        (n, 5) int: x0, z0, x1, z1 in cells, class.
    """
    rows = []
    size = len(classes)
    for z in range(0, size, _TILE):
        for x in range(0, size, _TILE):
            tile = classes[z : z + _TILE, x : x + _TILE]
            if (tile == tile[0, 0]).all():
                h, w = tile.shape
                rows.append((x, z, x + w, z + h, int(tile[0, 0])))
            else:
                rows += [(x + a, z + b, x + c, z + d, e) for a, b, c, d, e in _greedy(tile)]
    return np.array(rows, np.int64)


def _greedy(tile: Classes) -> list[tuple[int, int, int, int, int]]:
    cells: list[list[int]] = tile.tolist()
    height, width = tile.shape
    out = []
    for z in range(height):
        for x in range(width):
            kind = cells[z][x]
            if kind == 255:
                continue
            x1 = x
            while x1 < width and cells[z][x1] == kind:
                x1 += 1
            z1 = z + 1
            while z1 < height and all(c == kind for c in cells[z1][x:x1]):
                z1 += 1
            for row in cells[z:z1]:
                row[x:x1] = [255] * (x1 - x)
            out.append((x, z, x1, z1, kind))
    return out


def heights(classes: Classes, cell: float) -> NDArray[np.float32]:
    """Heights of the ground, (size, size) float32, with map cells of `cell` metres."""
    table = np.array(HEIGHTS, np.float32)[classes]
    factor = round(1 / cell)
    fine = np.repeat(np.repeat(table, factor, axis=0), factor, axis=1)
    middle = (np.arange(len(fine)) + 0.5) * cell - EXTENT
    x, z = np.meshgrid(middle[::4], middle[::4])
    land = land_height(x.ravel(), z.ravel()).reshape(x.shape).astype(np.float32)
    land = np.repeat(np.repeat(land, 4, axis=0), 4, axis=1)[: len(fine), : len(fine)]
    return np.maximum(fine, land)


def floors(layout: Layout) -> Surfaces:
    """Streets, squares, courts, gardens and causeways, and an underlay that closes pinholes."""
    table = rectangles(layout.classes)
    table = table[(table[:, 4] > Ground.CANAL) & (table[:, 4] != Ground.BUILT)]
    parts = [_level(table[table[:, 4] == g], HEIGHTS[g], look) for g, look in _LOOKS.items()]
    dry = rectangles((layout.classes > Ground.CANAL).astype(np.uint8))
    dry = dry[dry[:, 4] == 1]
    bed = _level(dry, 0.3, EARTH._replace(grain=0.0))
    return _join([*parts, bed])


def water(layout: Layout) -> Surfaces:
    """The lake and the canals; greener and darker where they are narrow."""
    table = rectangles(layout.classes)
    lake = table[table[:, 4] == Ground.WATER]
    middle = (lake[:, :2] + lake[:, 2:4]) / 2 - HALF
    land = land_height(middle[:, 0].astype(float), middle[:, 1].astype(float))
    lake = lake[land < 1.0]
    canals = table[table[:, 4] == Ground.CANAL]
    return _join(
        [
            _level(lake, 0.0, _WATER),
            _level(canals, 0.0, _WATER._replace(tint=rgb("b4ccb4"), grain=0.25)),
            _level(lake[:: 1], -0.6, Look(Material.DARK, rgb("2c4c54"), grain=0.0)),
        ]
    )


def _level(rows: NDArray[np.int64], y: float, look: Look) -> Surfaces:
    x0, z0, x1, z1 = ((rows[:, k] - HALF).astype(np.float64) for k in range(4))
    level = np.full(len(rows), y)
    shape = np.stack(
        [
            np.stack([x0, level, z1], axis=1),
            np.stack([x1, level, z1], axis=1),
            np.stack([x1, level, z0], axis=1),
            np.stack([x0, level, z0], axis=1),
        ],
        axis=1,
    )
    return _table(shape, look, np.stack([x1 - x0, z1 - z0], axis=1), flat=True)


def quays(layout: Layout) -> Surfaces:
    """Walls wherever the ground steps down, and kerbs along the water."""
    height = np.array(HEIGHTS)[layout.classes]
    wet = layout.classes <= Ground.CANAL
    walls = []
    for vertical in (True, False):
        a = height if vertical else height.T
        w = wet if vertical else wet.T
        c = layout.classes if vertical else layout.classes.T
        # boundary between column k - 1 and k, for every row
        for side in (1, -1):
            low = a[:, 1:] if side == 1 else a[:, :-1]
            high = a[:, :-1] if side == 1 else a[:, 1:]
            under = w[:, 1:] if side == 1 else w[:, :-1]
            made = c[:, :-1] if side == 1 else c[:, 1:]
            step = high > low + 1e-6
            for k in np.flatnonzero(step.any(axis=0)):
                key = np.where(step[:, k], high[:, k] * 64 + under[:, k] * 32 + made[:, k], -1)
                cuts = np.flatnonzero(np.diff(key)) + 1
                bounds = np.concatenate([[0], cuts, [len(key)]])
                for start, stop in zip(bounds[:-1], bounds[1:], strict=True):
                    if key[start] < 0:
                        continue
                    foot = -0.5 if under[start, k] else low[start, k] - 0.3
                    for s in range(int(start), int(stop), 28):
                        e = min(s + 28, int(stop))
                        walls.append((vertical, side, k + 1, s, e, foot, high[start, k]))
    return _wall_table(walls)


def _wall_table(walls: list[tuple[bool, int, int, int, int, float, float]]) -> Surfaces:
    shapes = np.empty((len(walls), 4, 3))
    sizes = np.empty((len(walls), 2))
    for n, (vertical, side, line, start, stop, foot, top) in enumerate(walls):
        c, a, b = line - HALF, start - HALF, stop - HALF
        # u must run to the right of who looks at the wall from the low side
        forward = (side == -1) if vertical else (side == 1)
        a, b = (a, b) if forward else (b, a)
        ends = [(c, a), (c, b)] if vertical else [(a, c), (b, c)]
        (x0, z0), (x1, z1) = ends
        shapes[n] = [(x0, foot, z0), (x1, foot, z1), (x1, top, z1), (x0, top, z0)]
        sizes[n] = stop - start, top - foot
    return _table(shapes, STONE.tinted(*rgb("c2b496")), sizes, flat=False)


def _table(shape: Floats, look: Look, sizes: Floats, flat: bool) -> Surfaces:
    n = len(shape)
    tile = TILE[look.material]
    uv = np.zeros((n, 3, 2))
    if flat:
        uv[:, 0] = shape[:, 0][:, [0, 2]] / tile
        uv[:, 1, 0] = sizes[:, 0] / tile
        uv[:, 2, 1] = -sizes[:, 1] / tile
    else:
        uv[:, 0, 1] = -shape[:, 0, 1] / tile
        uv[:, 1, 0] = sizes[:, 0] / tile
        uv[:, 2, 1] = -sizes[:, 1] / tile
    return Surfaces(
        kind=np.full(n, Kind.FLAT, np.uint8),
        shape=shape,
        extra=np.zeros((n, 3)),
        uv=uv,
        material=np.full(n, look.material, np.uint8),
        tint=np.tile(linear(look.tint), (n, 1)),
        rough=np.zeros(n),
        segments=sizes * look.grain,
        rank=uniform(31, np.rint(shape[:, 0] * 8).astype(int).sum(axis=1)[:, None], [[0, 1]]),
        levels=np.tile([0.0, ENDLESS], (n, 1)),
    )


def _join(parts: list[Surfaces]) -> Surfaces:
    from farfield_worker.demo.surfaces import concatenate

    return concatenate(parts)


def land() -> Surfaces:
    """The shore and the hills."""
    cell = 45.0
    count = int(2 * EXTENT / cell)
    i, j = np.meshgrid(np.arange(count), np.arange(count))
    x0, z0 = i.ravel() * cell - EXTENT, j.ravel() * cell - EXTENT
    top = np.full(len(x0), -9.0)
    for a in np.linspace(0, 1, 6):
        for b in np.linspace(0, 1, 6):
            top = np.maximum(top, land_height(x0 + a * cell, z0 + b * cell))
    keep = top > -0.8
    x0, z0, top = x0[keep], z0[keep], top[keep]
    zero = np.zeros(len(x0))
    shape = np.stack(
        [
            np.stack([x0, zero, z0 + cell], axis=1),
            np.stack([x0 + cell, zero, z0 + cell], axis=1),
            np.stack([x0 + cell, zero, z0], axis=1),
            np.stack([x0, zero, z0], axis=1),
        ],
        axis=1,
    )
    look = Look(Material.GRASS, rgb("d6d2b4"), grain=0.13)
    out = _table(shape, look, np.full((len(x0), 2), cell), flat=True)
    out.kind[:] = Kind.LAND
    out.rank[:] = 0.5  # all patches alike: no cracks between them
    return out
