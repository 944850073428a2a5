"""Packing microtextures into atlas pages: a skyline, the lowest place first.

The skyline of a page is the lower edge of what is placed, rows counted downwards as in the picture,
as segments from left to right. Rectangles come highest first; each goes where its upper edge lies
in the lowest row, leftmost among equals. What fits nowhere waits for the next page. Jylänki, "A
Thousand Ways to Pack the Bin" (2010), section 2.2 (bottom-left).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: texels around every rectangle that repeat its edge
GUTTER = 1


class Places(NamedTuple):
    """Where rectangles lie, (n,) int32 each: page, and column and row of their first texel."""

    page: NDArray[np.int32]
    x: NDArray[np.int32]
    y: NDArray[np.int32]


@njit(cache=True)
def _place(width, height, order, page_width, page_height, x, y):
    """Place those of `order` that fit on one page; x stays -1 for the others."""
    left = np.empty(page_width + 1, np.int32)  # where segments begin; the last entry is a wall
    level = np.empty(page_width + 1, np.int32)
    left[0], level[0], left[1] = 0, 0, page_width
    segments = 1
    narrowest, lowest = page_width + 1, 0  # nothing of this size or more fits any longer
    for n in order:
        w, h = width[n], height[n]
        if h == lowest and w >= narrowest:
            continue
        best, row = -1, page_height - h + 1
        for first in range(segments):
            if left[first] + w > page_width:
                break
            base, s = 0, first
            while base < row and left[s] < left[first] + w:
                base = max(base, level[s])
                s += 1
            if base < row:
                best, row = first, base
        if best < 0:
            narrowest, lowest = w, h
            continue
        x[n], y[n] = left[best], row
        # The new segment takes the place of those it covers; the last may stick out to its right.
        end = left[best] + w
        after = best
        while left[after + 1] < end:
            after += 1
        keep = left[after + 1] > end
        rest = level[after]
        move = best + 1 + keep - (after + 1)
        if move > 0:
            for s in range(segments, after, -1):
                left[s + move], level[s + move] = left[s], level[s]
        elif move < 0:
            for s in range(after + 1, segments + 1):
                left[s + move], level[s + move] = left[s], level[s]
        segments += move
        level[best] = row + h
        if keep:
            left[best + 1], level[best + 1] = end, rest


def pack(
    width: NDArray[np.int32], height: NDArray[np.int32], page_width: int, page_height: int
) -> Places:
    """Find places for rectangles (n,), apart by two gutters and one gutter from the pages' edges.

    Rectangles of one height keep their order. None may be larger than a page less two gutters.
    """
    width, height = width + 2 * GUTTER, height + 2 * GUTTER
    page, x, y = (np.full(len(width), -1, np.int32) for _ in range(3))
    order = np.argsort(-height, kind="stable")
    pages = 0
    while len(order):
        _place(width, height, order, page_width, page_height, x, y)
        placed = x[order] >= 0
        page[order[placed]] = pages
        order = order[~placed]
        pages += 1
    return Places(page, x + GUTTER, y + GUTTER)
