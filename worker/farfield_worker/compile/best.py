"""Rectangles that tolerate holes: greedy growth, then the cheapest merges.

Plain greedy growth (LEMI section 5) stops at the first texel that is not covered, so a sloping edge
becomes a staircase of rectangles and foliage falls to crumbs. A transparent texel inside a
rectangle compresses to nothing, but every quad costs a draw. So neighbours are merged into the box
around both, the pair that adds the least area first, until the rectangles of the face together are
only just `FULL` full. What lies wholly inside the new box goes with it. At last every texel goes to
the largest box that it lies in, and boxes shrink to what is left for them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from farfield_worker.compile.greedy import greedy

#: least share of covered texels in the rectangles of a face, all taken together
FULL = 0.75
_NEVER = 2**30
#: Rounds of merging: how many rectangles of a layer look for partners among each other, for more
#: go in bands of rows, and the most area that a merge may add. Comparing all with all is what takes
#: time; a first round among few does most of the merges that add next to nothing.
ROUNDS = ((64, 2), (1024, _NEVER))


@njit(cache=True)
def _added(left, top, right, bottom, i, j, widest, highest):
    """Area by which the box around boxes i and j exceeds both."""
    width = max(right[i], right[j]) - min(left[i], left[j])
    height = max(bottom[i], bottom[j]) - min(top[i], top[j])
    if width > widest or height > highest:
        return _NEVER
    both = (right[i] - left[i]) * (bottom[i] - top[i]) + (right[j] - left[j]) * (bottom[j] - top[j])
    return width * height - both


@njit(cache=True)
def _merge(boxes, texels, among, most, widest, highest):
    """Merge boxes (n, 5), sorted by (layer, y, x), that hold `texels` texels.

    Partners are sought `among` so many boxes, and no merge adds more area than `most`. Returns the
    boxes that remain, sorted by layer alone.
    """
    n = len(boxes)
    left, top = np.empty(2 * n, np.int32), np.empty(2 * n, np.int32)
    right, bottom = np.empty(2 * n, np.int32), np.empty(2 * n, np.int32)
    left[:n], top[:n] = boxes[:, 1], boxes[:, 2]
    right[:n], bottom[:n] = boxes[:, 1] + boxes[:, 3], boxes[:, 2] + boxes[:, 4]
    band = np.empty(2 * n, np.int32)  # its first box
    following = np.full(2 * n, -1, np.int32)  # the next box of a band
    begin = np.empty(n, np.int32)  # the first one alive
    size = 0
    for i in range(n):
        size += 1
        if i == 0 or boxes[i, 0] != boxes[i - 1, 0] or size > among:
            begin[i] = band[i] = i
            size = 1
        else:
            band[i] = band[i - 1]
            following[i - 1] = i
    alive = np.zeros(2 * n, np.bool_)
    alive[:n] = True
    best = np.full(2 * n, _NEVER, np.int32)  # least area that a merge adds, or less
    partner = np.zeros(2 * n, np.int32)
    for i in range(n):
        j = following[i]
        while j >= 0:
            cost = _added(left, top, right, bottom, i, j, widest, highest)
            if cost < best[i]:
                best[i], partner[i] = cost, j
            if cost < best[j]:
                best[j], partner[j] = cost, i
            j = following[j]
    area: Any = np.sum(boxes[:, 3] * boxes[:, 4])
    count = n
    while True:
        limit = _NEVER
        for i in range(count):
            if alive[i]:
                limit = min(limit, best[i])
        if limit == _NEVER or limit > most or (area + limit) * FULL > texels:
            break
        i = -1
        while i + 1 < count:
            i += 1
            if not alive[i] or best[i] > limit:
                continue
            if not alive[partner[i]]:
                best[i] = _NEVER
                j = begin[band[i]]
                while j >= 0:
                    if j != i:
                        cost = _added(left, top, right, bottom, i, j, widest, highest)
                        if cost < best[i]:
                            best[i], partner[i] = cost, j
                    j = following[j]
                if best[i] > limit:
                    continue
            if (area + best[i]) * FULL > texels:
                break
            j, new = partner[i], count
            left[new], top[new] = min(left[i], left[j]), min(top[i], top[j])
            right[new], bottom[new] = max(right[i], right[j]), max(bottom[i], bottom[j])
            area += (right[new] - left[new]) * (bottom[new] - top[new])
            band[new], alive[new] = band[i], True
            before, j = -1, begin[band[i]]
            while j >= 0:
                if (
                    left[new] <= left[j]
                    and top[new] <= top[j]
                    and right[j] <= right[new]
                    and bottom[j] <= bottom[new]
                ):
                    alive[j] = False
                    area -= (right[j] - left[j]) * (bottom[j] - top[j])
                    if before < 0:
                        begin[band[new]] = following[j]
                    else:
                        following[before] = following[j]
                else:
                    before = j
                    cost = _added(left, top, right, bottom, new, j, widest, highest)
                    if cost < best[new]:
                        best[new], partner[new] = cost, j
                    if cost < best[j]:
                        best[j], partner[j] = cost, new
                j = following[j]
            following[new] = begin[band[new]]
            begin[band[new]] = new
            count += 1
    remain = np.flatnonzero(alive[:count])
    out = np.empty((len(remain), 5), np.int32)
    for at in range(len(remain)):
        i = remain[at]
        out[at, 0] = boxes[band[i], 0]
        out[at, 1], out[at, 2] = left[i], top[i]
        out[at, 3], out[at, 4] = right[i] - left[i], bottom[i] - top[i]
    return out


@njit(cache=True)
def _share_out(texel, layer, resolution, candidates, owner, boxes):
    """Give every texel to the first of `candidates` that it lies in; returns their new number."""
    grid = np.full((resolution, resolution), -1, np.int32)  # texel with no rectangle yet
    count, first, n = 0, 0, 0
    while first < texel.size:
        last = first
        while last < texel.size and layer[last] == layer[first]:
            grid[texel[last] // resolution, texel[last] % resolution] = last
            last += 1
        while n < len(candidates) and candidates[n, 0] == layer[first]:
            _, x, y, width, height = candidates[n]
            left, top, right, bottom = resolution, resolution, 0, 0
            for row in range(y, y + height):
                for column in range(x, x + width):
                    at = grid[row, column]
                    if at >= 0:
                        owner[at] = count
                        grid[row, column] = -1
                        left, right = min(left, column), max(right, column + 1)
                        top, bottom = min(top, row), max(bottom, row + 1)
            if left < right:
                box = boxes[count]
                box[0], box[1], box[2] = layer[first], left, top
                box[3], box[4] = right - left, bottom - top
                count += 1
            n += 1
        first = last
    return count


def best(texel, layer, resolution, widest, highest, owner, boxes):
    """Cut texels, sorted by (layer, texel), into rectangles; returns their number.

    `texel` (n,) int32 and `layer` (n,) int16 are read; `owner` (n,) int32 gets each texel's
    rectangle, `boxes` (n, 5) int32 the rectangles: layer, x, y, width and height.
    """
    full = np.empty_like(boxes)
    count = greedy(texel, layer, resolution, widest, highest, owner, full)
    merged = full[:count]
    for band, most in ROUNDS:
        merged = _merge(merged, len(texel), band, most, widest, highest)
        merged = merged[np.lexsort((merged[:, 1], merged[:, 2], merged[:, 0]))]
    largest_first = np.lexsort((-merged[:, 3] * merged[:, 4], merged[:, 0]))
    return _share_out(texel, layer, resolution, merged[largest_first], owner, boxes)
