"""Texels averaged from a face drawn at a multiple of its resolution.

Of the n x n samples of a texel, those in one layer are averaged: colours in linear light, depths as
disparities. A layer covers the texel if its samples and those of the two neighbouring layers,
between which a border may split one surface, are at least half of n^2, and its own at least a
quarter. So outlines stay where half coverage puts them, and no border opens a crack.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import farfield_shading as shading
import numba
import numpy as np
from numpy.typing import NDArray

from farfield_worker.render.interface import FaceTexels, Renderer


class Supersampled:
    """Draws with another renderer at `factor` times the resolution and averages."""

    def __init__(self, renderer: Renderer, factor: int) -> None:
        self._renderer = renderer
        self._factor = factor
        self.name = renderer.name

    def face(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], resolution: int
    ) -> FaceTexels:
        """See `Renderer.face`."""
        samples = self._renderer.face(eye, face, borders, resolution * self._factor)
        return average(samples, resolution, self._factor)

    def close(self) -> None:
        """Close the renderer below."""
        self._renderer.close()


def average(samples: FaceTexels, resolution: int, factor: int) -> FaceTexels:
    """Texels of a face of `resolution` from those of one of `factor` times as much."""
    fine = resolution * factor
    start = np.zeros(fine * fine + 1, np.int64)
    start[1:] = np.cumsum(np.bincount(samples.texel, minlength=fine * fine))
    linear = shading.to_linear(np.arange(256) / 255.0)
    count = len(samples.texel)
    texel, layer = np.empty(count, np.int32), np.empty(count, np.int16)
    light, depth = np.empty((count, 3)), np.empty(count, np.float32)
    kept = _average(
        start,
        (samples.layer, samples.color, samples.depth),
        linear,
        resolution,
        factor,
        texel,
        layer,
        light,
        depth,
    )
    color = np.full((kept, 4), 255, np.uint8)
    color[:, :3] = np.rint(shading.to_srgb(light[:kept]) * 255.0)
    return FaceTexels(texel[:kept].copy(), layer[:kept].copy(), color, depth[:kept].copy())


@numba.njit(cache=True)
def _gather(cursor: Any, end: Any, samples: Any, linear: Any, sums: Any) -> int:
    """Sum the samples of one texel layer by layer; returns the number of layers.

    Runs of samples reach from `cursor` to `end`. `sums` has columns layer, samples, red, green,
    blue, disparity.
    """
    layers, colors, depths = samples
    found = 0
    while True:
        layer = 1 << 30
        for n in range(len(cursor)):
            if cursor[n] < end[n]:
                layer = min(layer, layers[cursor[n]])
        if layer == 1 << 30:
            return found
        sums[found] = 0.0
        sums[found, 0] = layer
        for n in range(len(cursor)):
            at = cursor[n]
            if at < end[n] and layers[at] == layer:
                cursor[n] += 1
                sums[found, 1] += 1.0
                for c in range(3):
                    sums[found, 2 + c] += linear[colors[at, c]]
                sums[found, 5] += 1.0 / depths[at]
        found += 1


@numba.njit(cache=True)
def _average(
    start: Any,
    samples: Any,
    linear: Any,
    resolution: int,
    factor: int,
    out_texel: Any,
    out_layer: Any,
    out_light: Any,
    out_depth: Any,
) -> int:
    """Average texel by texel; returns how many (texel, layer) pairs were written."""
    squared = factor * factor
    sums = np.empty((squared * np.diff(start).max(), 6))
    cursor, end = np.empty(squared, np.int64), np.empty(squared, np.int64)
    kept = 0
    for texel in range(resolution * resolution):
        row, column = texel // resolution * factor, texel % resolution * factor
        for n in range(squared):
            sample = (row + n // factor) * resolution * factor + column + n % factor
            cursor[n], end[n] = start[sample], start[sample + 1]
        found = _gather(cursor, end, samples, linear, sums)
        for n in range(found):
            own = around = sums[n, 1]
            if n > 0 and sums[n - 1, 0] == sums[n, 0] - 1.0:
                around += sums[n - 1, 1]
            if n + 1 < found and sums[n + 1, 0] == sums[n, 0] + 1.0:
                around += sums[n + 1, 1]
            if 2.0 * around >= squared and 4.0 * own >= squared:
                out_texel[kept], out_layer[kept] = texel, int(sums[n, 0])
                for c in range(3):
                    out_light[kept, c] = sums[n, 2 + c] / own
                out_depth[kept] = own / sums[n, 5]
                kept += 1
    return kept
