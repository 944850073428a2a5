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


def listed(planes: Planes) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """Texels and layers of all set bits, (n,) int32 and (n,) int16, in order of (layer, texel)."""
    _, resolution, words = planes.shape
    flat = planes.reshape(-1)
    at = np.flatnonzero(flat)
    octets = flat[at].astype("<u8").view(np.uint8).reshape(-1, 8)
    which, bit = np.nonzero(np.unpackbits(octets, axis=1, bitorder="little"))
    line, word = np.divmod(at[which], words)
    layer, row = np.divmod(line, resolution)
    return (row * resolution + word * 64 + bit).astype(np.int32), layer.astype(np.int16)


def erode(plane: Planes, down: int, across: int) -> Planes:
    """Bits whose whole neighbourhood of `down` rows and `across` columns either way is set.

    `plane` is (R, words); the neighbourhood is (2 down + 1) x (2 across + 1) texels and never
    whole beyond the face's edge.
    """
    one, top = np.uint64(1), np.uint64(63)
    for _ in range(down):
        inner = np.zeros_like(plane)
        np.bitwise_and(plane[:-2], plane[2:], out=inner[1:-1])
        plane = inner & plane
    for _ in range(across):
        right, left = plane << one, plane >> one
        right[:, 1:] |= plane[:, :-1] >> top
        left[:, :-1] |= plane[:, 1:] << top
        plane = right & left & plane
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
