"""From pictures of layers to sparse texels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from farfield_worker.render.interface import FaceTexels


class LayerTexels(NamedTuple):
    """Covered texels of one layer: (n,) int32 texels, ascending; (n,) uint32 packed RGBA8;
    (n,) float32 distances along the face's axis.
    """

    texel: NDArray[np.int32]
    color: NDArray[np.uint32]
    distance: NDArray[np.float32]


@numba.njit(cache=True)
def _collect(
    pixels: Any, column: int, row: int, resolution: int, least: int, texel: Any, bits: Any
) -> int:
    count = 0
    for y in range(pixels.shape[0]):
        for x in range(pixels.shape[1]):
            # positive floats are ordered like their bits
            if pixels[y, x, 1] > least:
                texel[count] = (row + y) * resolution + column + x
                bits[count, 0] = pixels[y, x, 0]
                bits[count, 1] = pixels[y, x, 1]
                count += 1
    return count


def collect(
    pixels: NDArray[np.uint32],
    column: int,
    row: int,
    resolution: int,
    least: np.float32,
    near: np.float32,
) -> LayerTexels:
    """Texels of a rectangle whose depth exceeds `least`, the layer's far end.

    `pixels` is (h, w, 2) uint32, a rectangle of `target.FaceTarget` with its corner at
    (column, row); what farther layers have left in it is not above `least`. `near` is the distance
    of the near clip plane, which has depth 1.
    """
    area = pixels.shape[0] * pixels.shape[1]
    texel, bits = np.empty(area, np.int32), np.empty((area, 2), np.uint32)
    least_bits = int(least.view(np.uint32))
    count = _collect(pixels, column, row, resolution, least_bits, texel, bits)
    color, depth = bits[:count, 0].copy(), bits[:count, 1].copy().view(np.float32)
    return LayerTexels(texel[:count].copy(), color, near / depth)


@numba.njit(cache=True)
def _scatter(
    part: Any, index: int, start: Any, texel: Any, layer: Any, color: Any, depth: Any
) -> None:
    for i in range(len(part.texel)):
        at = start[part.texel[i]]
        start[part.texel[i]] += 1
        texel[at], layer[at], color[at] = part.texel[i], index, part.color[i]
        depth[at] = part.distance[i]


def merge(layers: Sequence[tuple[int, LayerTexels]], resolution: int) -> FaceTexels:
    """Sort layers, given as (index, texels) with ascending index, into one face's texels."""
    count = sum(len(part.texel) for _, part in layers)
    start = np.zeros(resolution * resolution + 1, np.int32)
    for _, part in layers:
        start[part.texel + 1] += 1
    np.cumsum(start, out=start)
    texel, layer = np.empty(count, np.int32), np.empty(count, np.int16)
    color, depth = np.empty(count, np.uint32), np.empty(count, np.float32)
    for index, part in layers:
        _scatter(part, index, start, texel, layer, color, depth)
    return FaceTexels(texel, layer, color.view(np.uint8).reshape(-1, 4), depth)
