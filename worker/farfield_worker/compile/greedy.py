"""Plain greedy rectangle growth (LEMI section 5): full rectangles, one after the other.

In every layer, from the first texel that has no rectangle yet, in rows from the top, a rectangle
grows to the right and downwards in turn, a column or a row at a time, while the whole strip is
covered and still free.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def greedy(texel, layer, resolution, widest, highest, owner, boxes):
    """Cut texels, sorted by (layer, texel), into full rectangles; returns their number.

    `texel` (n,) int32 and `layer` (n,) int16 are read; `owner` (n,) int32 gets each texel's
    rectangle, `boxes` (n, 5) int32 the rectangles: layer, x, y, width and height.
    """
    grid = np.full((resolution, resolution), -1, np.int32)  # texel with no rectangle yet
    count = 0
    first = 0
    while first < texel.size:
        last = first
        while last < texel.size and layer[last] == layer[first]:
            grid[texel[last] // resolution, texel[last] % resolution] = last
            last += 1
        for seed in range(first, last):
            top, left = divmod(texel[seed], resolution)
            if grid[top, left] != seed:
                continue
            bottom, right = top + 1, left + 1
            wider, higher = True, True
            while wider or higher:
                if wider:
                    wider = right < resolution and right - left < widest
                    for row in range(top, bottom):
                        wider = wider and grid[row, right] >= 0
                    right += wider
                if higher:
                    higher = bottom < resolution and bottom - top < highest
                    for column in range(left, right):
                        higher = higher and grid[bottom, column] >= 0
                    bottom += higher
            for row in range(top, bottom):
                for column in range(left, right):
                    owner[grid[row, column]] = count
                    grid[row, column] = -1
            box = boxes[count]
            box[0], box[1], box[2] = layer[first], left, top
            box[3], box[4] = right - left, bottom - top
            count += 1
        first = last
    return count
