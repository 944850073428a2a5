"""Random faces for the tests of compilation, as the renderers would return them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from farfield_worker.render.interface import FaceTexels
from hypothesis import strategies as st
from numpy.typing import NDArray

#: sizes around the words of bit planes, and those in between
RESOLUTIONS = st.one_of(st.sampled_from([4, 63, 64, 65, 70]), st.integers(4, 70))
SEEDS = st.integers(0, 2**32 - 1)


class Fragment(NamedTuple):
    layer: int
    disparity: np.float32
    color: int


def distances(layers: int) -> NDArray[np.float64]:
    """Borders of `layers` layers, far to near, evenly spaced in disparity; the first is far."""
    return 1 / (0.002 + 0.001 * np.arange(1, layers + 1))


def random_face(seed: int, resolution: int, layers: int, most: int = 500) -> FaceTexels:
    """At most `most` fragments a sheet: sloping sheets with holes, in front of each other.

    They lie in a window, so that faces of several words are as cheap to check as small ones.
    """
    rng = np.random.default_rng(seed)
    height = int(rng.integers(1, resolution + 1))
    width = int(min(rng.integers(1, resolution + 1), max(most // height, 1)))
    top = int(rng.integers(0, resolution - height + 1))
    left = int(rng.choice([0, resolution - width, (resolution - width) // 2]))
    row, column = (a.ravel() for a in np.mgrid[top : top + height, left : left + width])
    texels, depths = [], []
    for _ in range(rng.integers(0, 4)):
        slope = rng.choice([0.0, 2e-4, 1e-3, 3e-3], 2) * rng.choice([-1, 1], 2)
        disparity = rng.uniform(0.001, 0.002 + 0.001 * layers)
        disparity = disparity + slope[0] * (row - top) + slope[1] * (column - left)
        disparity = disparity + rng.choice([0.0, 1e-4]) * rng.normal(size=len(row))
        keep = (rng.random(len(row)) < rng.choice([0.2, 0.8, 0.97, 1.0])) & (disparity > 1e-4)
        texels.append((row * resolution + column)[keep])
        depths.append(1 / disparity[keep])
    depth = np.concatenate([np.empty(0), *depths]).astype(np.float32)
    texel = np.concatenate([np.empty(0, np.int32), *texels]).astype(np.int32)
    return sorted_face(rng, texel, depth, layers)


def sorted_face(
    rng: np.random.Generator, texel: NDArray[np.int32], depth: NDArray[np.float32], layers: int
) -> FaceTexels:
    """The nearest fragment of each texel and layer, in the order renderers promise."""
    borders = distances(layers)
    layer = (depth[:, None] < borders).sum(axis=1).astype(np.int16)
    inside = layer < layers
    texel, depth, layer = texel[inside], depth[inside], layer[inside]
    order = np.lexsort((depth, layer, texel))
    texel, depth, layer = texel[order], depth[order], layer[order]
    first = np.ones(len(texel), bool)
    first[1:] = (np.diff(texel) != 0) | (np.diff(layer) != 0)
    color = rng.integers(0, 256, (int(first.sum()), 4), np.uint8)
    color[:, 3] = 255
    return FaceTexels(texel[first], layer[first], color, depth[first])


def by_texel(face: FaceTexels, resolution: int) -> dict[tuple[int, int], list[Fragment]]:
    """The fragments at each (row, column), farthest first."""
    out: dict[tuple[int, int], list[Fragment]] = {}
    colors = face.color.view(np.uint32).ravel()
    disparity = np.float32(1) / face.depth
    for n, (texel, layer) in enumerate(zip(face.texel, face.layer, strict=True)):
        at = divmod(int(texel), resolution)
        out.setdefault(at, []).append(Fragment(int(layer), disparity[n], int(colors[n])))
    return out


def dense(face: FaceTexels, layers: int, resolution: int) -> NDArray[np.bool_]:
    """Which texels of the first `layers` layers are covered, (layers, R, R)."""
    out = np.zeros((layers, resolution * resolution), bool)
    own = face.layer < layers
    out[face.layer[own], face.texel[own]] = True
    return out.reshape(layers, resolution, resolution)


def random_planes(seed: int, layers: int, resolution: int) -> NDArray[np.bool_]:
    """Boxes and holes, so that there is something to erode and to hide, (layers, R, R)."""
    rng = np.random.default_rng(seed)
    out = rng.random((layers, resolution, resolution)) < rng.choice([0.0, 0.02, 0.3])
    for _ in range(rng.integers(0, 3 * layers + 1)):
        layer = rng.integers(layers)
        (top, bottom), (left, right) = np.sort(rng.integers(0, resolution + 1, (2, 2)), axis=1)
        out[layer, top:bottom, left:right] |= rng.random() < 0.8
    return out & (rng.random(out.shape) < rng.choice([0.95, 1.0]))


def packed(planes: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Dense planes as bit planes, one bit after the other."""
    layers, resolution, _ = planes.shape
    out = np.zeros((layers, resolution, (resolution + 63) // 64), np.uint64)
    for layer, row, column in np.argwhere(planes):
        out[layer, row, column // 64] |= np.uint64(1 << (int(column) % 64))
    return out


def unpacked(planes: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Bit planes as dense planes; a bit beyond the face fails."""
    layers, resolution, words = planes.shape
    out = np.zeros((layers, resolution, words * 64), bool)
    for layer, row, word in np.argwhere(planes):
        bits = int(planes[layer, row, word])
        for bit in range(64):
            out[layer, row, word * 64 + bit] = bits >> bit & 1
    assert not out[:, :, resolution:].any()
    return out[:, :, :resolution]
