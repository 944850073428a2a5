"""Rectangles of texels as the quad columns of the walk format (docs/format.md, "Cell files")."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from farfield_core.walk import Quads
from numpy.typing import NDArray

from farfield_worker.compile.pack import Places

Ints = NDArray[np.int32]


class Rectangles(NamedTuple):
    """Rectangles of texels of all faces, (n,) int32 each; (x, y) is the first texel."""

    face: Ints
    layer: Ints
    x: Ints
    y: Ints
    width: Ints
    height: Ints

    @property
    def turned(self) -> NDArray[np.bool_]:
        """Those that are stored lying down, x and y swapped: all that are higher than wide."""
        return self.height > self.width

    def take(self, order: NDArray[np.intp]) -> Rectangles:
        """Return the rectangles in another order."""
        return Rectangles(*(column[order] for column in self))

    def front_to_back(self) -> NDArray[np.intp]:
        """Return the order in which they are drawn: nearest layer first."""
        return np.lexsort((self.face, -self.layer))


def layer_quads(boxes: Rectangles, places: Places, layers: Sequence[float]) -> Quads:
    """Quads of `boxes`, in their order, on planes of the layers' disparities.

    All refer to the cell's centre; corners go round from the first texel's outer corner.
    """
    n = len(boxes.face)
    left, top = boxes.x, boxes.y
    right, bottom = left + boxes.width, top + boxes.height
    corners = np.stack((left, top, right, top, right, bottom, left, bottom), axis=1)
    planes = np.zeros((n, 3))
    planes[:, 2] = (1 / np.asarray(layers))[boxes.layer]
    turned = boxes.turned
    along, across = np.where(turned, top, left), np.where(turned, left, top)
    offsets = np.stack((places.x - along, places.y - across), axis=1)
    return Quads(
        eyes=(0,) * n,
        faces=tuple(boxes.face.tolist()),
        layers=tuple(boxes.layer.tolist()),
        corner_counts=(4,) * n,
        corners=tuple(corners.ravel().tolist()),
        planes=tuple(planes.ravel().tolist()),
        pages=tuple(places.page.tolist()),
        scales=(1.0,) * n,
        offsets=tuple(offsets.ravel().tolist()),
        turned=tuple(turned.astype(int).tolist()),
    )
