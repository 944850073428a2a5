"""What every reader hands over: meshes, materials and where each mesh stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.images import Picture

Wrap = Literal["repeat", "clamp", "mirror"]
Filter = Literal["linear", "nearest"]


@dataclass(frozen=True)
class TextureUse:
    """A picture as a material uses it.

    Attributes:
        picture: the pixels.
        wrap_u, wrap_v, filter: how it is sampled.
        texcoord: which set of texture coordinates it reads (glTF's TEXCOORD_n).
        transform: (2, 3) float as nested tuples, uv' = transform @ (u, v, 1).
    """

    picture: Picture
    wrap_u: Wrap = "repeat"
    wrap_v: Wrap = "repeat"
    filter: Filter = "linear"
    texcoord: int = 0
    transform: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None


@dataclass(frozen=True)
class Material:
    """How a mesh looks, before it is sorted into batches. Colours are linear.

    Attributes:
        base: texture of base colour and opacity.
        factor: base colour factor, RGBA.
        emissive, emissive_texture: light given off.
        alpha: glTF's alpha mode.
        cutoff: opacity from which a "mask" material draws.
    """

    name: str = ""
    base: TextureUse | None = None
    factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emissive_texture: TextureUse | None = None
    alpha: Literal["opaque", "mask", "blend"] = "opaque"
    cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False


@dataclass
class Mesh:
    """Triangles of one material in a space of their own.

    Attributes:
        positions: (n, 3) float32.
        triangles: (m, 3) uint32, counter-clockwise seen from the front.
        material: index into `Model.materials`.
        normals: (n, 3) float32 of any length, or None: flat.
        uvs: (n, 2) float32, v running down the picture, texture transform applied, or None.
        colors: (n, 4) uint16, linear times 65535, or None: white.
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    material: int
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    colors: NDArray[np.uint16] | None = None


@dataclass
class Model:
    """A whole model as read.

    Attributes:
        meshes, materials: the parts.
        placed: (k,) int32, the mesh of each instance.
        matrices: (k, 4, 4) float64, mesh space to scene space, column vectors.
        notes: what was left out or guessed, a sentence each.
        shapes, copies: (k,) int32 each, or None: of which object each instance is a part, and of
            which of its copies; instances of one copy stand under one matrix. -1: of none.
    """

    meshes: list[Mesh]
    materials: list[Material]
    placed: NDArray[np.int32]
    matrices: NDArray[np.float64]
    notes: list[str] = field(default_factory=list)
    shapes: NDArray[np.int32] | None = None
    copies: NDArray[np.int32] | None = None


def one_of_each(meshes: list[Mesh], materials: list[Material], notes: list[str]) -> Model:
    """Return a model in which every mesh stands once, as it is."""
    placed = np.arange(len(meshes), dtype=np.int32)
    return Model(meshes, materials, placed, np.tile(np.eye(4), (len(meshes), 1, 1)), notes)
