"""Corridors: which view cells to bake, from a box or a path (docs/corridors.md).

    {"box":  {"min": [x, y, z], "max": [x, y, z]}}
    {"path": {"points": [[x, y, z], ...], "width": w, "height": h}}

A box is cut from its min corner; its last cells may reach over. The points of a path lie on the
walked floor. A path sweeps a disc of diameter `width` along its points, from their y up to
y + height, and takes every cell of the lattice that the swept volume overlaps. The first point lies
at the middle of the floor of cell (0, 0, 0), so a path that is lengthened keeps its cells.
With "follow_ground" there is one cell a column and storey, as high above the ground as puts the
walker's eye ("eye_height", 1.7 m unless given) at the cell's middle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from farfield_core import sweep
from farfield_core.cells import CellGrid
from farfield_core.errors import BadInputError
from farfield_core.validation import Alike, Flag, Number, parse

Floats = NDArray[np.float64]

#: (x (n,), z (n,), y hint (n,)) -> (n,) height of the ground nearest to the hint, NaN where none
Ground = Callable[[Floats, Floats, Floats], Floats]

MAX_CELLS = 2_000_000

Coordinate = Annotated[Number, Field(ge=-1e9, le=1e9)]
Point = Annotated[tuple[Coordinate, Coordinate, Coordinate], Alike()]
Length = Annotated[Number, Field(gt=0, le=1e9)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Box(_Model):
    """An axis-aligned box, metres, scene coordinates."""

    min: Point
    max: Point

    @model_validator(mode="after")
    def _has_extent(self) -> Box:
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if not high > low:
                raise ValueError(f"the box is empty along {axis}: min {low:g}, max {high:g}")
        return self


class Path_(_Model):  # noqa: N801 - the word of the format, beside pathlib's
    """A walk along points on the floor, metres, scene coordinates."""

    points: Annotated[tuple[Point, ...], Field(min_length=1, max_length=1_000_000)]
    width: Length
    height: Length


class Corridor(_Model):
    """A corridor file."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {
                    "required": [one],
                    "properties": {one: {"type": "object"}, other: {"type": "null"}},
                }
                for one, other in (("box", "path"), ("path", "box"))
            ]
        }
    )

    box: Box | None = None
    path: Path_ | None = None
    follow_ground: Flag = False
    #: height of the walker's eye above the floor, metres
    eye_height: Length = 1.7

    @model_validator(mode="after")
    def _one_kind(self) -> Corridor:
        if (self.box is None) == (self.path is None):
            raise ValueError("a corridor is either a box or a path; give exactly one of them")
        return self


def parse_corridor(data: bytes | str | dict[str, Any], what: str = "The corridor") -> Corridor:
    """Read a corridor file's content; raises BadInputError."""
    return parse(Corridor, data, what)


def read_corridor(path: Path) -> Corridor:
    """Read a corridor file; raises BadInputError."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadInputError(f"The corridor {path} cannot be read: {error.strerror}.") from None
    return parse_corridor(data, f"The corridor {path}")


def cut(
    corridor: Corridor, cell_size: tuple[float, float, float], ground: Ground | None = None
) -> CellGrid:
    """Cut a corridor into cells of `cell_size` metres, ordered as they should be baked.

    `ground` is asked only where the corridor follows the ground; without it, or where it answers
    NaN, the corridor's own floor is taken. Raises BadInputError.
    """
    size = np.asarray(cell_size, np.float64)
    if size.shape != (3,) or not (np.isfinite(size) & (size > 0)).all():
        raise BadInputError(
            "A cell needs three positive edge lengths; give --cell-size S or X,Y,Z."
        )
    if corridor.box is not None:
        return _cut_box(corridor, corridor.box, size, ground)
    assert corridor.path is not None
    return _cut_path(corridor, corridor.path, size, ground)


def _check_count(count: float) -> None:
    if count > MAX_CELLS:
        raise BadInputError(
            f"The corridor has {count:.3g} cells, more than {MAX_CELLS}; "
            "use larger cells or a smaller corridor."
        )


def _eye_at_middle(floor: Floats, corridor: Corridor, size: Floats, ground: Floats) -> Floats:
    """Lowest y of cells whose middle is the eye over `ground`, over `floor` where that is NaN."""
    under = np.where(np.isnan(ground), floor, ground)
    return np.asarray(under + corridor.eye_height - size[1] / 2, np.float64)


def box_shape(box: Box, size: Floats, follow_ground: bool) -> tuple[int, int, int]:
    """Number of cells of a box along each axis; raises BadInputError if there are too many."""
    extent = np.asarray(box.max) - np.asarray(box.min)
    # a box of exactly n cells must not grow by one through rounding
    counts = np.maximum(np.ceil(extent / size - 1e-6), 1.0)
    if follow_ground:
        counts[1] = 1.0
    _check_count(float(counts.prod()))
    return int(counts[0]), int(counts[1]), int(counts[2])


def _cut_box(corridor: Corridor, box: Box, size: Floats, ground: Ground | None) -> CellGrid:
    """Cells by steps walked from the middle of one end of the box's longer side, floor first."""
    origin = np.asarray(box.min, np.float64)
    shape = box_shape(box, size, corridor.follow_ground)
    index: NDArray[np.int32] = np.stack(
        np.unravel_index(np.arange(math.prod(shape)), shape), axis=1
    ).astype(np.int32)
    along, across = (0, 2) if shape[0] * size[0] >= shape[2] * size[2] else (2, 0)
    sideways = np.abs(index[:, across] - (shape[across] - 1) // 2)
    steps = index[:, along] + sideways + index[:, 1]
    index = index[np.lexsort((index[:, across], index[:, 1], sideways, steps))]
    y = origin[1] + index[:, 1] * size[1]
    if corridor.follow_ground:
        x, _, z = (origin + (index + 0.5) * size).T
        floor = np.full(len(index), origin[1])
        heights = floor if ground is None else ground(x, z, floor)
        y = _eye_at_middle(floor, corridor, size, heights)
    return CellGrid(origin, size, index, y)


def _cut_path(corridor: Corridor, path: Path_, size: Floats, ground: Ground | None) -> CellGrid:
    """Cells of the swept volume, in the order in which a walker comes near them."""
    points = np.asarray(path.points, np.float64)
    origin = points[0] - size * (0.5, 0.0, 0.5)
    # everything below is in units of cells, relative to the lattice
    lattice = (points - origin) / size
    if corridor.follow_ground:
        return _cut_storeys(corridor, path, size, ground, origin, lattice)
    cells = sweep.swept_cells(
        lattice,
        radius=(path.width / 2 / size[0], path.width / 2 / size[2]),
        height=path.height / size[1],
        limit=MAX_CELLS,
    )
    _check_count(len(cells.index))
    eye = cells.floor + corridor.eye_height / size[1]
    from_eye = np.abs(cells.index[:, 1] + 0.5 - eye)
    index = cells.index[np.lexsort((from_eye, cells.aside, cells.along))]
    return CellGrid(origin, size, index, origin[1] + index[:, 1] * size[1])


def _cut_storeys(
    corridor: Corridor,
    path: Path_,
    size: Floats,
    ground: Ground | None,
    origin: Floats,
    lattice: Floats,
) -> CellGrid:
    """One cell for each column and storey that the path visits; j counts storeys from below."""
    visits = sweep.swept_columns(
        lattice,
        radius=(path.width / 2 / size[0], path.width / 2 / size[2]),
        limit=MAX_CELLS,
    )
    floor = origin[1] + visits.floor * size[1]
    x = origin[0] + (visits.index[:, 0] + 0.5) * size[0]
    z = origin[2] + (visits.index[:, 2] + 0.5) * size[2]
    heights = floor if ground is None else ground(x, z, floor)
    y = _eye_at_middle(floor, corridor, size, heights)
    # visits of one column less than half a cell apart are the same storey
    order = np.lexsort((y, visits.index[:, 2], visits.index[:, 0]))
    index, y = visits.index[order].copy(), y[order]
    along, aside = visits.along[order], visits.aside[order]
    new_column = np.ones(len(index), bool)
    new_column[1:] = (np.diff(index[:, 0]) != 0) | (np.diff(index[:, 2]) != 0)
    new_storey = new_column.copy()
    new_storey[1:] |= np.diff(y) > size[1] / 2
    storey = np.cumsum(new_storey) - 1
    first_storey = np.maximum.accumulate(np.where(new_column, storey, 0))
    index[:, 1] = storey - first_storey
    # of each storey keep the visit that a walker makes first
    pick = np.lexsort((aside, along, storey))
    pick = pick[np.concatenate(([True], np.diff(storey[pick]) != 0))]
    _check_count(len(pick))
    pick = pick[np.lexsort((aside[pick], along[pick]))]
    return CellGrid(origin, size, index[pick], y[pick])
