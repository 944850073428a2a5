"""The layers of one face, compiled: fill gaps, remove hidden texels, cut into rectangles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_worker.compile import bitplanes
from farfield_worker.compile.best import best
from farfield_worker.compile.gaps import columns, fill_gaps, sources
from farfield_worker.compile.greedy import greedy
from farfield_worker.compile.hidden import hidden, reaches
from farfield_worker.compile.steep import fill_steep
from farfield_worker.render.interface import FaceTexels

GROWERS: dict[str, Callable[..., int]] = {"greedy": greedy, "best": best}


class Rules(NamedTuple):
    """How layers are compiled.

    Attributes:
        layers: distances of the layers, far to near, metres.
        resolution: texels across a face.
        grower: how texels become rectangles.
        largest: most texels along an edge of a rectangle.
        steep: whether surfaces that skip layers are filled too, beyond the paper's rule.
    """

    layers: Sequence[float]
    resolution: int
    grower: Literal["greedy", "best"]
    largest: int
    steep: bool = True


class ShownFace(NamedTuple):
    """Texels of one face that are worth storing.

    Attributes:
        texel: (n,) int32, row * resolution + column, in order of (layer, texel).
        layer: (n,) int16.
        color: (n,) uint32, little-endian RGBA.
        filled: (n,) bool, put there by gap filling.
        rendered: texels before anything was filled or removed.
    """

    texel: NDArray[np.int32]
    layer: NDArray[np.int16]
    color: NDArray[np.uint32]
    filled: NDArray[np.bool_]
    rendered: int

    def take(self, which: NDArray[np.bool_]) -> ShownFace:
        """Those of a mask (n,)."""
        return ShownFace(
            self.texel[which],
            self.layer[which],
            self.color[which],
            self.filled[which],
            self.rendered,
        )


class CompiledFace(NamedTuple):
    """Texels of one face and the rectangles they are in.

    Attributes:
        texel: (n,) int32, row * resolution + column, in order of (layer, texel).
        color: (n,) uint32, little-endian RGBA.
        owner: (n,) int32, the rectangle of each texel.
        boxes: (m, 5) int32, layer, x, y, width and height of each rectangle.
        rendered: texels before anything was filled or removed.
        filled: texels that gap filling added and hidden-texel removal left.
    """

    texel: NDArray[np.int32]
    color: NDArray[np.uint32]
    owner: NDArray[np.int32]
    boxes: NDArray[np.int32]
    rendered: int
    filled: int


def shown_texels(texels: FaceTexels, rules: Rules, half: tuple[float, float, float]) -> ShownFace:
    """Fill gaps and remove hidden texels of a face of a cell.

    `half` are the cell's half extents in the face's axes (right, down, forward). `texels` have one
    layer more, just inside the near field: it is filled under like any other, so that no gap opens
    at the near border, and not stored.
    """
    count, resolution = len(rules.layers), rules.resolution
    shifts = reaches(rules.layers, half, resolution)
    rings = max([1, *(max(pair) for pair in shifts)])
    drawn = bitplanes.empty(count + 1, resolution)
    bitplanes.put(drawn, texels.texel, texels.layer)
    covered = drawn[:count] | fill_gaps(drawn, rings)
    unseen = hidden(covered, shifts)
    starts = columns(texels.texel, resolution)
    if rules.steep:
        covered |= fill_steep(texels, starts, covered | unseen, rings)
        unseen = hidden(covered, shifts)
    texel, layer = bitplanes.listed(covered & ~unseen)
    source = sources(starts, texels.layer, texel, layer)
    return ShownFace(
        texel,
        layer,
        texels.color.view(np.uint32).reshape(-1)[source],
        texels.layer[source] > layer,
        int((texels.layer < count).sum()),
    )


def cut(shown: ShownFace, rules: Rules) -> CompiledFace:
    """Cut the texels of a face into rectangles."""
    owner = np.empty(len(shown.texel), np.int32)
    boxes = np.empty((len(shown.texel), 5), np.int32)
    boxes_made = GROWERS[rules.grower](
        shown.texel, shown.layer, rules.resolution, rules.largest, rules.largest, owner, boxes
    )
    return CompiledFace(
        shown.texel,
        shown.color,
        owner,
        boxes[:boxes_made].copy(),
        shown.rendered,
        int(shown.filled.sum()),
    )


def gutter_free(page: int, gutter: int) -> int:
    """Longest edge of a rectangle that fits on a page `page` texels wide."""
    return max(1, page - 2 * gutter)
