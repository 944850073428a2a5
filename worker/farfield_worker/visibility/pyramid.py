"""Occlusion culling by a pyramid of minima: what lies behind everything drawn in its rectangle.

After N. Greene, M. Kass and G. Miller, "Hierarchical Z-Buffer Visibility" (SIGGRAPH 1993), with
disparities in place of depths. For maps that are drawn by OpenGL and read back as a whole.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.visibility.clusters import InView


def not_behind(clusters: InView, drawn: NDArray[np.float32]) -> InView:
    """Those of `clusters` that `drawn` (h, w), disparities so far, 0 if none, may not hide."""
    pyramid = [drawn]
    while min(pyramid[-1].shape) > 1:
        pyramid.append(_halve(pyramid[-1]))
    keep = np.ones(len(clusters.cluster), np.bool_)
    size = (clusters.rect[:, 2:] - clusters.rect[:, :2]).max(axis=1, initial=1)
    level = np.minimum(np.ceil(np.log2(np.maximum(size, 1))).astype(np.int32), len(pyramid) - 1)
    for k, minima in enumerate(pyramid):
        here = np.flatnonzero(level == k)
        _test(minima, k, clusters.rect[here], clusters.disparity[here], here, keep)
    return clusters.take(keep)


def _halve(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Minima of 2 x 2 values; odd edges are continued."""
    h, w = values.shape[0] // 2, values.shape[1] // 2
    rows = values[::2].copy()
    np.minimum(rows[:h], values[1::2], out=rows[:h])
    least = rows[:, ::2].copy()
    np.minimum(least[:, :w], rows[:, 1::2], out=least[:, :w])
    return least


@njit(cache=True)
def _test(minima: Any, level: int, rect: Any, disparity: Any, where: Any, keep: Any) -> None:
    """Clear `keep` for clusters behind everything drawn in their rectangles."""
    for i in range(len(rect)):
        least = np.inf
        for y in range(rect[i, 1] >> level, ((rect[i, 3] - 1) >> level) + 1):
            for x in range(rect[i, 0] >> level, ((rect[i, 2] - 1) >> level) + 1):
                least = min(least, minima[y, x])
        if least > disparity[i]:
            keep[where[i]] = False
