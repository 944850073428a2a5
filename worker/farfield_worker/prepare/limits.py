"""What a model file may ask for, and the one way to refuse it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from farfield_core.errors import SceneRefusedError


@dataclass(frozen=True)
class Limits:
    """Ceilings that no honest model meets and that keep a lying one from costing memory.

    Attributes:
        triangles: triangles drawn, instances counted.
        decoded_bytes: bytes that compressed, sparse or converted data may unpack to.
        pixels: pixels of one picture.
        picture_pixels: pixels of all pictures together.
        json_bytes: size of a glTF's JSON.
        nodes: nodes and instances.
    """

    triangles: int = 250_000_000
    decoded_bytes: int = 8 << 30
    pixels: int = 16384 * 16384 // 3
    picture_pixels: int = 1 << 30
    json_bytes: int = 512 << 20
    nodes: int = 20_000_000


def refuse(name: str, cause: str) -> NoReturn:
    """Raise SceneRefusedError: one sentence that names the file and the cause."""
    raise SceneRefusedError(f"{name} cannot be read: {cause.rstrip('.')}.")
