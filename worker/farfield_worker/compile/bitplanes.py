"""Layers as bit planes: one bit a texel, 64 texels of a row to a word.

A face of R texels and N layers is an array (N, R, ceil(R / 64)) uint64; bit c % 64 of word
c // 64 is column c. 64 layers of 2048 texels take 32 MB, and the 3x3 neighbourhoods that gap
filling and hidden-texel removal (LEMI section 5) ask for are a few shifts of whole words. Beyond
the face every bit is 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Planes = NDArray[np.uint64]


def empty(layers: int, resolution: int) -> Planes:
    """No texel covered: (layers, resolution, words) uint64."""
    return np.zeros((layers, resolution, -(-resolution // 64)), np.uint64)


@njit(cache=True)
def put(planes: Any, texel: Any, layer: Any) -> None:
    """Set the bits of texels (n,) int32 (row * resolution + column) on layers (n,) int16."""
    resolution = planes.shape[1]
    for n in range(texel.size):
        row, column = divmod(texel[n], resolution)
        planes[layer[n], row, column >> 6] |= np.uint64(1) << np.uint64(column & 63)


@njit(cache=True)
def _list(planes: Any, texel: Any, layer: Any) -> int:
    """Write the set bits' texels and layers, in order; returns their number."""
    layers, resolution, words = planes.shape
    count = 0
    for i in range(layers):
        for row in range(resolution):
            for word in range(words):
                left, column = planes[i, row, word], word * 64
                while left != 0:
                    if left & np.uint64(1):
                        texel[count], layer[count] = row * resolution + column, i
                        count += 1
                    left >>= np.uint64(1)
                    column += 1
    return count


def listed(planes: Planes) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """Texels and layers of all set bits, (n,) int32 and (n,) int16, in order of (layer, texel)."""
    count = int(np.bitwise_count(planes).sum())
    texel, layer = np.empty(count, np.int32), np.empty(count, np.int16)
    _list(planes, texel, layer)
    return texel, layer


@njit(cache=True)
def erode(plane: Any, down: int, across: int) -> Any:
    """Bits whose whole neighbourhood of `down` rows and `across` columns either way is set.

    `plane` is (R, words) uint64; the neighbourhood is (2 down + 1) x (2 across + 1) texels and
    never whole beyond the face's edge.
    """
    rows, words = plane.shape
    one, top = np.uint64(1), np.uint64(63)
    for _ in range(down):
        inner = np.zeros_like(plane)
        for row in range(1, rows - 1):
            for word in range(words):
                inner[row, word] = plane[row - 1, word] & plane[row, word] & plane[row + 1, word]
        plane = inner
    for _ in range(across):
        inner = np.empty_like(plane)
        for row in range(rows):
            for word in range(words):
                here = plane[row, word]
                before = plane[row, word - 1] >> top if word > 0 else np.uint64(0)
                after = plane[row, word + 1] << top if word + 1 < words else np.uint64(0)
                inner[row, word] = (here << one | before) & here & (here >> one | after)
        plane = inner
    return plane


def dilate(plane: Planes, rings: int) -> Planes:
    """Bits with a set bit at most `rings` rows and columns away; `plane` is (R, words).

    Bits beyond the face's edge may be set in the last word.
    """
    one, top = np.uint64(1), np.uint64(63)
    for _ in range(rings):
        wider = plane | plane << one | plane >> one
        wider[:, 1:] |= plane[:, :-1] >> top
        wider[:, :-1] |= plane[:, 1:] << top
        plane = wider.copy()
        plane[1:] |= wider[:-1]
        plane[:-1] |= wider[1:]
    return plane
