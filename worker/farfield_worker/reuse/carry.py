"""Carries a cell's record over from an earlier bake, where another look would show the same.

It has to be the same cell under the same settings, baked by the same version of the baker, and no
triangle that came or went may show (reuse/shows.py). Its atlas pages and near blocks stay where
they are: bakes share them. What no eye of the cell can see may be out of date in it.
"""

from __future__ import annotations

import numpy as np
from farfield_core import layout
from farfield_core.bake import predecessor, read_walk, settings_of
from farfield_core.cells import Index, cell_name
from farfield_core.errors import NotFoundError
from farfield_core.scene import PreparedScene
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from farfield_core.validation import parse
from farfield_core.walk import CellFile, Walk
from numpy.typing import NDArray

from farfield_worker.cell.version import VERSION
from farfield_worker.reuse.changes import Changes, changes
from farfield_worker.reuse.shows import Shows, eyes_of, slack


class Carrier:
    """Carries cells of `walk` over from the bake `before`, of the same settings."""

    def __init__(self, store: Store, walk: Walk, before: Walk, scene: PreparedScene) -> None:
        self._store = store
        self._walk, self._before = walk, before
        self._grid = walk_grid(store, before)
        self._settings: BakeSettings = settings_of(walk)
        earlier = scene
        self._changes = Changes(np.zeros(0, np.int64), np.zeros(0, np.int64))
        if before.scene.id != walk.scene.id:
            earlier = open_prepared(store, before.scene.id)
            self._changes = changes(earlier, scene)
        self._shows = [
            Shows(place, triangles)
            for place, triangles in ((earlier, self._changes.gone), (scene, self._changes.come))
            if len(triangles)
        ]

    def carry(self, index: Index, centre: NDArray[np.float64]) -> CellFile | None:
        """Write the record of the cell `index` around `centre` (3,); None if it is to be baked."""
        data = self._record(index, centre)
        if data is None:
            return None
        cell = parse(CellFile, data, f"The cell {cell_name(index)} of bake {self._before.id}")
        if cell.figures.get("baker") != VERSION or not self._has_blobs(cell):
            return None
        if self._matters(centre):
            return None
        self._store.put_new(layout.cell_key(self._walk.id, index), data)
        return cell

    def _record(self, index: Index, centre: NDArray[np.float64]) -> bytes | None:
        """The cell's file as it was baked before."""
        try:
            if not np.array_equal(self._grid.centre(index), centre):
                return None
            return self._store.get(layout.cell_key(self._before.id, index))
        except NotFoundError:
            return None

    def _has_blobs(self, cell: CellFile) -> bool:
        blobs = [layout.atlas_key(name) for name in cell.atlases]
        blobs += [layout.near_key(block.blob) for block in cell.near]
        return all(self._store.exists(key) for key in blobs)

    def _matters(self, centre: NDArray[np.float64]) -> bool:
        if not self._shows:
            return False
        if self._settings.visibility == "off":
            return True
        eyes = eyes_of(centre, self._settings)
        nearer = slack(self._settings)
        return any(
            shows.from_eyes(eyes, self._settings.resolution, nearer) for shows in self._shows
        )


def open_carrier(store: Store, walk: Walk, scene: PreparedScene) -> Carrier | None:
    """The carrier of a bake that follows another; None where there is nothing to carry over."""
    name = predecessor(store, walk.id)
    if name is None:
        return None
    try:
        before = read_walk(store, name)
        if settings_of(before) != settings_of(walk) or before.grid.size != walk.grid.size:
            return None
        return Carrier(store, walk, before, scene)
    except NotFoundError:  # whoever deleted it wants its cells no more
        return None
