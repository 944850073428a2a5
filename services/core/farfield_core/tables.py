"""The cell table of walk.json: inline for small corridors, in page files for large ones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_core import layout
from farfield_core.cells import CellGrid
from farfield_core.errors import BadInputError
from farfield_core.scene import Bounds, Triple
from farfield_core.store import Store
from farfield_core.validation import parse
from farfield_core.walk import CellPage, CellTable, Walk, WalkGrid

#: cells in a page; no more than this are kept inline
PAGE_CELLS = 4096


class Tables(NamedTuple):
    """A walk's grid, and its page files by href."""

    grid: WalkGrid
    pages: dict[str, CellTable]


def cell_table_pages(grid: CellGrid) -> Tables:
    """Write a grid as an inline table in baking order, or as pages of cells that lie together."""
    origin, size = _triple(grid.origin), _triple(grid.size)
    if len(grid) <= PAGE_CELLS:
        rows = np.arange(len(grid))
        table = WalkGrid(origin=origin, size=size, total=len(grid), cells=_table(grid, rows))
        return Tables(table, {})
    order = np.argsort(_morton(grid.index), kind="stable")
    low, high = grid.corners(), grid.corners() + grid.size
    pages, tables = [], {}
    for n, first in enumerate(range(0, len(grid), PAGE_CELLS)):
        rows = order[first : first + PAGE_CELLS]
        href = f"pages/{n}.json"
        bounds = Bounds(min=_triple(low[rows].min(axis=0)), max=_triple(high[rows].max(axis=0)))
        pages.append(CellPage(href=href, cells=len(rows), bounds=bounds))
        tables[href] = _table(grid, rows)
    table = WalkGrid(origin=origin, size=size, total=len(grid), pages=tuple(pages))
    return Tables(table, tables)


def walk_grid(store: Store, walk: Walk) -> CellGrid:
    """All cells of a walk; a paged walk's pages are read from the store.

    Cells are in baking order, those of a paged walk by their distance from its start.
    """
    grid = walk.grid
    index = np.empty((grid.total, 3), np.int32)
    y = np.empty(grid.total)
    row = 0
    # one page after the other: as Python's numbers a million cells would take half a gigabyte
    for table in _tables(store, walk):
        rows = slice(row, row := row + len(table.i))
        if row > grid.total:
            break
        index[rows] = np.array([table.i, table.j, table.k], np.int32).T
        y[rows] = table.y
    if row != grid.total:
        raise BadInputError(
            f"Walk {walk.id} says that it has {grid.total} cells, but lists others."
        )
    cells = CellGrid(np.array(grid.origin), np.array(grid.size), index, y)
    if grid.cells is not None:
        return cells
    distance = ((cells.centres() - np.array(walk.start.eye)) ** 2).sum(axis=1)
    order = np.argsort(distance, kind="stable")
    return CellGrid(cells.origin, cells.size, index[order], y[order])


def _tables(store: Store, walk: Walk) -> Iterator[CellTable]:
    if walk.grid.cells is not None:
        yield walk.grid.cells
    prefix = layout.bake_prefix(walk.id)
    for page in walk.grid.pages:
        yield parse(CellTable, store.get(prefix + page.href), page.href)


def _triple(values: NDArray[np.float64]) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])


def _table(grid: CellGrid, rows: NDArray[np.int64]) -> CellTable:
    i, j, k = grid.index[rows].T.tolist()
    return CellTable(i=tuple(i), j=tuple(j), k=tuple(k), y=tuple(grid.y[rows].tolist()))


def _morton(index: NDArray[np.int32]) -> NDArray[np.uint64]:
    """Place of each lattice index (n, 3) on a Z-order curve, (n,); 21 bits an axis."""
    cells = (index.astype(np.int64) - index.min(axis=0)).astype(np.uint64)
    code = np.zeros(len(cells), np.uint64)
    for bit in range(21):
        for axis in range(3):
            one = (cells[:, axis] >> np.uint64(bit)) & np.uint64(1)
            code |= one << np.uint64(3 * bit + axis)
    return code
