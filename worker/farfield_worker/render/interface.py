"""What a renderer promises: the texels of every layer of one face, sparse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray


class FaceTexels(NamedTuple):
    """Covered texels of one face, sorted by (texel, layer).

    Attributes:
        texel: (n,) int32, row * resolution + column.
        layer: (n,) int16, 0 = farthest.
        color: (n, 4) uint8, sRGB, shaded; alpha is 255 (dithered or masked out texels are absent).
        depth: (n,) float32, distance Z along the face's axis, metres.
    """

    texel: NDArray[np.int32]
    layer: NDArray[np.int16]
    color: NDArray[np.uint8]
    depth: NDArray[np.float32]


class Renderer(Protocol):
    """Draws a prepared scene. Create it in the process that uses it, never before a fork."""

    #: GL vendor and renderer string, for logs
    name: str

    def face(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], resolution: int
    ) -> FaceTexels:
        """Texels of all layers of `face`, seen from `eye` (3,) in scene coordinates.

        Layer i holds the nearest surface with Z in [borders[i], borders[i - 1]), layer 0 up to
        infinity; nothing nearer than borders[-1] is drawn.
        """
        ...

    def close(self) -> None:
        """Free what the renderer holds."""
        ...
