"""Rectangle growth that tolerates holes: far fewer quads for a few transparent texels.

Plain greedy growth (LEMI section 5) stops at the first texel that is not covered, so a sloping edge
becomes a staircase of rectangles. Here a rectangle grows on all four sides, always by the fullest
strip, as long as that strip is at least `STRIP` full and the rectangle at least `FULL`; what
is transparent inside costs bytes that compress to nothing, while every quad costs a draw. Texels
that another rectangle owns count as transparent.
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: least share of covered texels of a strip that a rectangle grows by
STRIP = 0.2
#: least share of covered texels of a rectangle
FULL = 0.66


@njit(cache=True)
def best(texel, layer, resolution, widest, highest, owner, boxes):
    """Cut texels, sorted by (layer, texel), into rectangles; returns their number.

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
            covered = 1
            while True:
                # the strips to the left, right, top and bottom, each as its number of texels
                side, most, gain = -1, 0.0, 0
                for s in range(4):
                    hits = 0
                    if s < 2:
                        length = bottom - top
                        column = left - 1 if s == 0 else right
                        if column < 0 or column >= resolution or right - left >= widest:
                            continue
                        for row in range(top, bottom):
                            hits += grid[row, column] >= 0
                    else:
                        length = right - left
                        row = top - 1 if s == 2 else bottom
                        if row < 0 or row >= resolution or bottom - top >= highest:
                            continue
                        for column in range(left, right):
                            hits += grid[row, column] >= 0
                    share = hits / length
                    if share > most:
                        side, most, gain = s, share, hits
                if side < 0 or most < STRIP:
                    break
                width, height = right - left, bottom - top
                area = (width + 1) * height if side < 2 else width * (height + 1)
                if covered + gain < FULL * area:
                    break
                covered += gain
                if side == 0:
                    left -= 1
                elif side == 1:
                    right += 1
                elif side == 2:
                    top -= 1
                else:
                    bottom += 1
            for row in range(top, bottom):
                for column in range(left, right):
                    if grid[row, column] >= 0:
                        owner[grid[row, column]] = count
                        grid[row, column] = -1
            box = boxes[count]
            box[0], box[1], box[2] = layer[first], left, top
            box[3], box[4] = right - left, bottom - top
            count += 1
        first = last
    return count
