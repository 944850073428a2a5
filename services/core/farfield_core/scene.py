"""The prepared scene: render-ready geometry in plain arrays that many processes map at once.

A folder `prepared/` holds

    scene.json       bounds, counts, batches, blocks, textures (the models below)
    positions.npy    (n, 3) float32, metres, relative to `origin`
    normals.npy      (n, 4) int8, unit normals times 127, last component 0
    uvs.npy          (n, 2) float32, glTF texture coordinates (v runs down the image)
    colors.npy       (n, 4) uint16, linear base colour factor times vertex colour, times 65535
    triangles.npy    (m, 3) uint32, indices into the vertices
    textures/<name>  PNG files, sRGB, straight alpha
    repeats.json     objects of which the scene has several copies, if any (`Repeats`)
    owners.npy       (m, 1) int32, the copy that each triangle is part of, or -1; with repeats.json
    objects/<name>   each of those objects as a true impostor (docs/format.md)
    map.png, thumbnail.png

Triangles are sorted by block, inside a block by batch, inside a batch along a space-filling curve;
each block is a contiguous range and owns its vertices. Front faces wind counter-clockwise and agree
with the stored normals. scene.json is written last: a scene is ready when it exists.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from farfield_core.errors import NotFoundError

VERSION: Literal[1] = 1

Triple = tuple[float, float, float]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Texture(_Model):
    """One image of the scene."""

    file: str
    width: int
    height: int
    wrap_u: Literal["repeat", "clamp", "mirror"] = "repeat"
    wrap_v: Literal["repeat", "clamp", "mirror"] = "repeat"
    filter: Literal["linear", "nearest"] = "linear"


class Batch(_Model):
    """Triangles that draw with the same state; base colour factors live in the vertex colours.

    `alpha` says how opacity is decided: "opaque" ignores it, "mask" draws where it reaches
    `cutoff`, "dither" screens it (glTF's BLEND where the opacity is even, such as glass). BLEND
    with a varying opacity, such as foliage, becomes "mask" at half the greatest opacity.
    """

    texture: int | None = None
    emissive: Triple = (0.0, 0.0, 0.0)
    emissive_texture: int | None = None
    alpha: Literal["opaque", "mask", "dither"] = "opaque"
    cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False


class Part(_Model):
    """The triangles of one batch inside one block."""

    batch: int
    first_triangle: int
    triangles: int


class Block(_Model):
    """A spatial chunk of triangles; its bounds are relative to the scene's origin."""

    low: Triple
    high: Triple
    first_vertex: int
    vertices: int
    parts: tuple[Part, ...]

    @property
    def first_triangle(self) -> int:
        """First triangle of the block."""
        return self.parts[0].first_triangle

    @property
    def triangles(self) -> int:
        """Number of triangles in the block."""
        return sum(part.triangles for part in self.parts)


class Bounds(_Model):
    """An axis-aligned box in scene coordinates."""

    min: Triple
    max: Triple


class MapView(_Model):
    """The top view: which rectangle of the ground it shows. Columns run along +x, rows along +z."""

    file: str
    width: int
    height: int
    #: x and z of the picture's upper left corner, scene coordinates
    min: tuple[float, float]
    #: x and z of its lower right corner
    max: tuple[float, float]


class Suspicion(_Model):
    """How a model seems to be meant, where that is not how it was read."""

    up: Literal["y", "z"]
    #: metres in one of the model's units
    scale: float


class SceneInfo(_Model):
    """scene.json."""

    version: Literal[1] = VERSION
    id: str
    name: str
    bounds: Bounds
    origin: Triple
    triangles: int
    vertices: int
    textures: tuple[Texture, ...]
    batches: tuple[Batch, ...]
    blocks: tuple[Block, ...]
    #: absent where the machine that prepared the scene could not draw
    map: MapView | None = None
    #: what was left out or guessed while reading, a sentence each
    notes: tuple[str, ...] = ()
    #: absent where the model seems to be upright and in metres
    suspected: Suspicion | None = None


class Repeats(_Model):
    """repeats.json: objects that repeat, and their copies.

    Attributes:
        shapes: object files in `objects/`.
        shape: for each copy which of them it is; -1 where none does it justice.
        places: where each copy stands in scene coordinates, and its scale.
        turns: unit quaternions x, y, z, w.
    """

    shapes: tuple[str, ...]
    shape: tuple[int, ...]
    places: tuple[tuple[float, float, float, float], ...]
    turns: tuple[tuple[float, float, float, float], ...]


@dataclass(frozen=True)
class PreparedScene:
    """A prepared scene, its arrays mapped from disk (shapes in the module's docstring)."""

    folder: Path
    info: SceneInfo
    positions: NDArray[np.float32]
    normals: NDArray[np.int8]
    uvs: NDArray[np.float32]
    colors: NDArray[np.uint16]
    triangles: NDArray[np.uint32]
    repeats: Repeats | None = None
    owners: NDArray[np.int32] | None = None

    @property
    def origin(self) -> NDArray[np.float64]:
        """Where the arrays' zero lies in scene coordinates, (3,) float."""
        return np.asarray(self.info.origin, np.float64)


ARRAYS = ("positions", "normals", "uvs", "colors", "triangles")


def open_scene(folder: Path) -> PreparedScene:
    """Map the prepared scene in `folder`; raises NotFoundError if it is not (yet) there."""
    try:
        text = (folder / "scene.json").read_text(encoding="utf-8")
    except FileNotFoundError:
        raise NotFoundError(f"There is no prepared scene in {folder}; prepare it first.") from None
    return map_scene(folder, SceneInfo.model_validate_json(text))


def map_scene(folder: Path, info: SceneInfo) -> PreparedScene:
    """Map the arrays in `folder`, which `info` describes."""
    arrays: dict[str, Any] = {
        name: np.load(folder / f"{name}.npy", mmap_mode="r") for name in ARRAYS
    }
    try:
        text = (folder / "repeats.json").read_text(encoding="utf-8")
    except FileNotFoundError:
        return PreparedScene(folder, info, **arrays)
    arrays["owners"] = np.load(folder / "owners.npy", mmap_mode="r")
    return PreparedScene(folder, info, **arrays, repeats=Repeats.model_validate_json(text))
