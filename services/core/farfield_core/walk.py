"""The walk format: walk.json and cell files as Python objects (docs/format.md).

The JSON Schemas in `format/` are the source; these models are tested against them. Read as JSON, a
document has to be complete; in Python the members that always say the same may be left out.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, model_validator

from farfield_core.scene import Bounds, Triple
from farfield_core.validation import WHOLE

VERSION: Literal[1] = 1

#: near polygons are drawn up to this multiple of `near_field`, so that no crack opens there
OVERLAP = 17 / 16


Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Extent = tuple[Positive, Positive, Positive]
Text = Annotated[str, Field(min_length=1)]
Folder = Annotated[str, Field(pattern="/$")]


class StrictModel(BaseModel):
    """A document: read as JSON it has to be complete."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="after")
    def _complete(self, info: ValidationInfo) -> Self:
        if info.mode == "json":
            for name in type(self).model_fields:
                if name not in self.model_fields_set:
                    raise ValueError(f"{name} is missing")
        return self


class WalkScene(StrictModel):
    """What a walk says of its scene."""

    id: Text
    name: str
    triangles: Count
    bounds: Bounds


class CellPage(StrictModel):
    """A slice of a large corridor's cells, kept in a file of its own."""

    href: Text
    cells: Annotated[int, Field(ge=1)]
    bounds: Bounds


class CellTable(StrictModel):
    """Cells by column: lattice index and lowest y of each."""

    i: tuple[int, ...]
    j: tuple[int, ...]
    k: tuple[int, ...]
    y: tuple[float, ...]


class WalkGrid(StrictModel):
    """The lattice of view cells: inline for small corridors, paged for large ones."""

    origin: Triple
    size: Extent
    total: Annotated[int, Field(ge=1)]
    cells: CellTable | None = None
    pages: tuple[CellPage, ...] = ()

    @model_validator(mode="after")
    def _inline_or_paged(self) -> WalkGrid:
        if (self.cells is None) == (not self.pages):
            raise ValueError("a grid has either its cells or pages of them")
        return self


class AtlasFormat(StrictModel):
    """All atlas pages of a walk are of this size."""

    width: Annotated[int, Field(ge=1)]
    height: Annotated[int, Field(ge=1)]
    encoding: Literal["png", "webp"]


class Places(StrictModel):
    """Where things lie, relative to walk.json; each ends in a slash."""

    cells: Folder = "cells/"
    atlases: Folder = "../../blobs/atlases/"
    near: Folder = "../../blobs/near/"


class Start(StrictModel):
    """Where a walker begins: an eye inside a cell, yaw and pitch in radians."""

    eye: Triple
    yaw: float
    pitch: float


class Walk(StrictModel):
    """walk.json."""

    format: Literal["farfield-walk"] = "farfield-walk"
    version: Annotated[Literal[1], WHOLE] = VERSION
    id: Text
    name: str
    scene: WalkScene
    settings: dict[str, Any]
    resolution: Annotated[int, Field(ge=2)]
    layers: tuple[Positive, ...]
    borders: tuple[Positive, ...]
    near_field: Positive
    grid: WalkGrid
    atlas: AtlasFormat
    light: dict[str, Triple]
    places: Places = Places()
    start: Start

    @property
    def near_drawn(self) -> float:
        """Half width of the cube to which near polygons are clipped, metres."""
        return self.near_field * OVERLAP


class Quads(StrictModel):
    """Quads by column, drawn front to back in this order.

    Quad q has `corner_counts[q]` corners, taken in turn from `corners`, which holds x, y pairs in
    texels of its face: u = 2 x / resolution - 1, v = 2 y / resolution - 1. Its plane is
    d = a u + b v + c with (a, b, c) = planes[3 q : 3 q + 3]. Texel coordinates on its page are
    scale * (x, y) + offset, x and y swapped first if it is turned.
    """

    eyes: tuple[Count, ...]
    faces: tuple[Annotated[int, Field(ge=0, le=5)], ...]
    layers: tuple[Annotated[int, Field(ge=-1)], ...]
    corner_counts: tuple[Annotated[int, Field(ge=3, le=8)], ...]
    corners: tuple[float, ...]
    planes: tuple[float, ...]
    pages: tuple[Count, ...]
    scales: tuple[Positive, ...]
    offsets: tuple[float, ...]
    turned: tuple[Annotated[int, Field(ge=0, le=1)], ...]


class NearBlock(StrictModel):
    """Triangles of one near block that belong to a cell.

    `ranges` holds (primitive, first triangle, triangles) triples, flat.
    """

    blob: Annotated[str, Field(pattern=r"^[0-9a-f]{32}\.glb$")]
    ranges: tuple[Count, ...]


class CellFile(StrictModel):
    """cells/<i>_<j>_<k>.json."""

    format: Literal["farfield-cell"] = "farfield-cell"
    version: Annotated[Literal[1], WHOLE] = VERSION
    cell: tuple[int, int, int]
    eyes: Annotated[tuple[Triple, ...], Field(min_length=1)]
    quads: Quads
    atlases: tuple[Annotated[str, Field(pattern=r"^[0-9a-f]{32}\.(png|webp)$")], ...]
    near: tuple[NearBlock, ...]
    figures: dict[str, float]
