"""Triangles divided into compact blocks: a balanced k-d tree over their centroids.

Bentley, "Multidimensional binary search trees used for associative searching" (1975); every cut
lies across the longest side of what is left, at a rank that leaves both sides whole blocks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: most triangles in a block
BLOCK_TRIANGLES = 4096


def split(
    centroids: NDArray[np.float32], largest: int = BLOCK_TRIANGLES
) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Order of triangles and where blocks start in it.

    Args:
        centroids: (t, 3) float32; left permuted into the order returned.
        largest: most triangles in a block.

    Returns:
        order: (t,) uint32, triangle numbers, block after block.
        starts: (b + 1,) int64.
    """
    order = np.arange(len(centroids), dtype=np.uint32)
    starts = [0]
    stack = [(0, len(centroids))]
    while stack:
        low, high = stack.pop()
        if high - low <= largest:
            if high > low:
                starts.append(high)
            continue
        part = centroids[low:high]
        axis = int(np.argmax(part.max(axis=0) - part.min(axis=0)))
        blocks = -(-(high - low) // largest)
        cut = (high - low) * (blocks // 2) // blocks
        rank = np.argpartition(part[:, axis], cut)
        centroids[low:high] = part[rank]
        order[low:high] = order[low:high][rank]
        stack += [(low + cut, high), (low, low + cut)]
    return order, np.array(starts, np.int64)
