"""The walk format: walk.json and cell files as Python objects (docs/format.md).

The JSON Schemas in `format/` are the source; these models are tested against them.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from farfield_core.scene import Bounds, Triple

VERSION: Literal[1] = 1


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class WalkScene(_Model):
    """What a walk says of its scene."""

    id: str
    name: str
    triangles: int
    bounds: Bounds


class CellPage(_Model):
    """A slice of a large corridor's cells, kept in a file of its own."""

    href: str
    cells: int
    bounds: Bounds


class CellTable(_Model):
    """Cells by column: lattice index and lowest y of each."""

    i: tuple[int, ...]
    j: tuple[int, ...]
    k: tuple[int, ...]
    y: tuple[float, ...]


class WalkGrid(_Model):
    """The lattice of view cells: inline for small corridors, paged for large ones."""

    origin: Triple
    size: Triple
    total: int
    cells: CellTable | None = None
    pages: tuple[CellPage, ...] = ()


class AtlasFormat(_Model):
    """All atlas pages of a walk are of this size."""

    width: int
    height: int
    encoding: Literal["png", "webp"]


class Places(_Model):
    """Where things lie, relative to walk.json; each ends in a slash."""

    cells: str = "cells/"
    atlases: str = "../../blobs/atlases/"
    near: str = "../../blobs/near/"


class Start(_Model):
    """Where a walker begins: an eye inside a cell, yaw and pitch in radians."""

    eye: Triple
    yaw: float
    pitch: float


class Walk(_Model):
    """walk.json."""

    format: Literal["farfield-walk"] = "farfield-walk"
    version: Literal[1] = VERSION
    id: str
    name: str
    scene: WalkScene
    settings: dict[str, Any]
    resolution: int
    layers: tuple[float, ...]
    borders: tuple[float, ...]
    near_field: float
    grid: WalkGrid
    atlas: AtlasFormat
    light: dict[str, tuple[float, float, float]]
    places: Places = Places()
    start: Start


class Quads(_Model):
    """Quads by column, drawn front to back in this order.

    Quad q has `corner_counts[q]` corners, taken in turn from `corners`, which holds x, y pairs in
    texels of its face: u = 2 x / resolution - 1, v = 2 y / resolution - 1. Its plane is
    d = a u + b v + c with (a, b, c) = planes[3 q : 3 q + 3]. Texel coordinates on its page are
    scale * (x, y) + offset, x and y swapped first if it is turned.
    """

    eyes: tuple[int, ...]
    faces: tuple[int, ...]
    layers: tuple[int, ...]
    corner_counts: tuple[int, ...]
    corners: tuple[float, ...]
    planes: tuple[float, ...]
    pages: tuple[int, ...]
    scales: tuple[float, ...]
    offsets: tuple[float, ...]
    turned: tuple[int, ...]


class NearBlock(_Model):
    """Triangles of one near block that belong to a cell.

    `ranges` holds (primitive, first triangle, triangles) triples, flat.
    """

    blob: str
    ranges: tuple[int, ...]


class CellFile(_Model):
    """cells/<i>_<j>_<k>.json."""

    format: Literal["farfield-cell"] = "farfield-cell"
    version: Literal[1] = VERSION
    cell: tuple[int, int, int]
    eyes: tuple[Triple, ...]
    quads: Quads
    atlases: tuple[str, ...]
    near: tuple[NearBlock, ...]
    figures: dict[str, float]
