"""Where one can see through a surface: opacity of materials with holes, looked up as GL does.

Opacity is the texture's times the vertices' (gl/material.py). It is filtered between the texels and
the two mipmaps next to the footprint's size, so that foliage is as dense here as in the renderers'
pictures; no more than that is needed to tell what is hidden.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray
from PIL import Image

OPAQUE, MASK, DITHER = 0, 1, 2
_WRAPS = {"repeat": 0, "clamp": 1, "mirror": 2}


class Cutouts(NamedTuple):
    """Opacity of a scene's materials; t textures, at most l mipmaps each.

    Attributes:
        kind: (batches,) int32, OPAQUE, MASK or DITHER.
        cutoff: (batches,) float64, least opacity that MASK draws.
        texture: (batches,) int32, row of what follows; -1 if none.
        wrap: (t, 2) int32, 0 repeat, 1 clamp, 2 mirror, along u and v.
        starts: (t, l) int64, first of each mipmap's `texels`.
        sizes: (t, l, 2) int64, width and height.
        levels: (t,) int64, how many mipmaps each has.
        texels: (n,) uint8, opacities row by row.
        uvs: (vertices, 2) float, texture coordinates.
        colors: (vertices, 4) uint16, whose last is opacity.
    """

    kind: NDArray[np.int32]
    cutoff: NDArray[np.float64]
    texture: NDArray[np.int32]
    wrap: NDArray[np.int32]
    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]
    levels: NDArray[np.int64]
    texels: NDArray[np.uint8]
    uvs: NDArray[Any]
    colors: NDArray[Any]

    @classmethod
    def of(cls, scene: PreparedScene) -> Cutouts:
        """Read the opacities of a scene's textures, those that matter."""
        batches = scene.info.batches
        kinds = {"opaque": OPAQUE, "mask": MASK, "dither": DITHER}
        used = sorted({b.texture for b in batches if b.alpha != "opaque" and b.texture is not None})
        pyramids = []
        for number in used:
            path = scene.folder / "textures" / scene.info.textures[number].file
            with Image.open(path) as image:
                pyramids.append(mipmaps(np.asarray(image.convert("RGBA").getchannel("A"))))
        levels = max(map(len, pyramids), default=1)
        starts = np.zeros((max(len(used), 1), levels), np.int64)
        sizes = np.zeros((max(len(used), 1), levels, 2), np.int64)
        texels, total = [np.zeros(1, np.uint8)], 1
        for row, pyramid in enumerate(pyramids):
            for level, opacities in enumerate(pyramid):
                starts[row, level], sizes[row, level] = total, opacities.shape[::-1]
                texels.append(opacities.reshape(-1))
                total += opacities.size
        wraps = [scene.info.textures[number] for number in used]
        return cls(
            np.array([kinds[b.alpha] for b in batches], np.int32),
            np.array([b.cutoff for b in batches], np.float64),
            np.array([used.index(b.texture) if b.texture in used else -1 for b in batches]).astype(
                np.int32
            ),
            np.array([(_WRAPS[t.wrap_u], _WRAPS[t.wrap_v]) for t in wraps] or [(0, 0)], np.int32),
            starts,
            sizes,
            np.array([len(pyramid) for pyramid in pyramids] or [1], np.int64),
            np.concatenate(texels),
            np.asarray(scene.uvs),
            np.asarray(scene.colors),
        )


def mipmaps(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """`image` (h, w) and its halves down to one texel; an odd last row or column is left out."""
    out = [np.ascontiguousarray(image)]
    while max(out[-1].shape) > 1:
        last = out[-1].astype(np.uint16)
        h, w = last.shape
        rows = last[: h // 2 * 2 : 2] + last[1::2] if h > 1 else 2 * last
        both = rows[:, : w // 2 * 2 : 2] + rows[:, 1::2] if w > 1 else 2 * rows
        out.append(((both + 2) // 4).astype(np.uint8))
    return out


@njit(cache=True, inline="always")
def wrapped(i: int, n: int, how: int) -> int:
    """Texel i of n along an axis under a wrap mode."""
    j = i % (2 * n) if how == 2 else i % n
    if how == 1:
        j = min(max(i, 0), n - 1)
    return 2 * n - 1 - j if j >= n else j


@njit(cache=True, inline="always")
def opacity(cutouts: Any, row: int, u: float, v: float, lod: float) -> float:
    """Opacity of texture `row` at (u, v), `lod` mipmaps down, 0 to 1."""
    texels, how_u, how_v = cutouts.texels, cutouts.wrap[row, 0], cutouts.wrap[row, 1]
    last = cutouts.levels[row] - 1
    lod = min(max(lod, 0.0), float(last))
    total = 0.0
    for k in range(2):
        level = min(int(lod) + k, last)
        share = 1.0 - abs(lod - (int(lod) + k))
        if share <= 0.0:
            continue
        width, height = cutouts.sizes[row, level, 0], cutouts.sizes[row, level, 1]
        x, y = u * width - 0.5, v * height - 0.5
        left, top = int(np.floor(x)), int(np.floor(y))
        fx, fy = x - left, y - top
        x0, x1 = wrapped(left, width, how_u), wrapped(left + 1, width, how_u)
        y0, y1 = wrapped(top, height, how_v), wrapped(top + 1, height, how_v)
        base = cutouts.starts[row, level]
        upper = texels[base + y0 * width + x0] * (1.0 - fx) + texels[base + y0 * width + x1] * fx
        lower = texels[base + y1 * width + x0] * (1.0 - fx) + texels[base + y1 * width + x1] * fx
        total += share * (upper * (1.0 - fy) + lower * fy)
    return total / 255.0


@njit(cache=True, inline="always")
def dithered(alpha: float, column: int, row: int) -> bool:
    """Whether a surface of opacity `alpha` is drawn at a texel: `ff_dither` of shading/."""
    x = (column & 3) ^ (row & 3)
    y = row & 3
    rank = ((x & 1) << 3) | ((y & 1) << 2) | (x & 2) | ((y & 2) >> 1)
    return alpha > (rank + 0.5) / 16.0
