"""A walk's files: the manifest, which cell an eye is in, and bytes by name."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import numpy as np
from farfield_core.cells import Index, cell_name
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.walk import CellFile, CellTable, Walk
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

#: Bytes of a file named relative to walk.json; raises NotFoundError.
Read = Callable[[str], bytes]

Model = TypeVar("Model", bound=BaseModel)


def read_folder(folder: Path) -> Read:
    """Read files from a local folder, the one that holds walk.json."""

    def read(key: str) -> bytes:
        try:
            return (folder / key).read_bytes()
        except FileNotFoundError:
            raise NotFoundError(f"The walk in {folder} has no file {key}.") from None

    return read


class WalkFiles:
    """Reads a walk through `read`."""

    def __init__(self, read: Read) -> None:
        self._read = read
        self.walk = self._model(Walk, "walk.json")

    def cell(self, index: Index) -> CellFile:
        """One cell's file; raises NotFoundError if it is not (yet) baked."""
        return self._model(CellFile, f"{self.walk.places.cells}{cell_name(index)}.json")

    def atlas(self, name: str) -> bytes:
        """An atlas page."""
        return self._read(self.walk.places.atlases + name)

    def near(self, name: str) -> bytes:
        """A near block, or a texture that near blocks name."""
        return self._read(self.walk.places.near + name)

    def nearest(self, eye: NDArray[np.float64]) -> Iterator[Index]:
        """Cells of the manifest from the nearest on; first the one that holds `eye`."""
        grid = self.walk.grid
        if grid.cells is not None:
            yield from (index for _, index in _ranked(self.walk, grid.cells, eye))
            return
        pages = sorted(
            (float(_distance(np.array(p.bounds.min), np.array(p.bounds.max), eye)), p.href)
            for p in grid.pages
        )
        waiting: list[tuple[float, Index]] = []
        for distance, href in pages:
            while waiting and waiting[0][0] < distance:
                yield heapq.heappop(waiting)[1]
            for ranked in _ranked(self.walk, self._model(CellTable, href), eye):
                heapq.heappush(waiting, ranked)
        while waiting:
            yield heapq.heappop(waiting)[1]

    def baked(self) -> Iterator[CellFile]:
        """Every cell that exists, from the walk's start on."""
        for index in self.nearest(np.array(self.walk.start.eye)):
            with suppress(NotFoundError):
                yield self.cell(index)

    def _model(self, model: type[Model], key: str) -> Model:
        try:
            return model.model_validate_json(self._read(key))
        except ValidationError as error:
            what = error.errors()[0]
            place = ".".join(str(part) for part in what["loc"])
            raise BadInputError(
                f"{key} is not in the walk format this version reads ({place}: {what['msg']})."
            ) from None


def _distance(
    low: NDArray[np.float64], high: NDArray[np.float64], eye: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of `eye` to boxes (..., 3), 0 inside."""
    outside = np.maximum(np.maximum(low - eye, eye - high), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=-1))


def _ranked(walk: Walk, table: CellTable, eye: NDArray[np.float64]) -> list[tuple[float, Index]]:
    """Cells of a table, nearest first, and how far: -1 for the one that holds `eye`."""
    size = np.array(walk.grid.size)
    index = np.array([table.i, table.j, table.k], np.int64).reshape(3, -1).T
    low = np.array(walk.grid.origin) + index * size
    low[:, 1] = table.y
    # of two cells that touch, the one above a side owns it
    owned = ((low <= eye) & (eye < low + size)).all(axis=1)
    distances = np.where(owned, -1.0, _distance(low, low + size, eye))
    return [
        (float(distances[row]), (int(index[row, 0]), int(index[row, 1]), int(index[row, 2])))
        for row in np.argsort(distances, kind="stable")
    ]
