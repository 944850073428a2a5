"""Cut the fragments of one face into sheets: sets of texels that one disparity plane can draw.

Every fragment allows an interval of disparities (slanted/tolerance.py). A *sheet* is a rectangle of
texels, a plane d = a u + b v + c, and the fragments it has captured: at each of its texels those,
not yet taken, whose interval holds the plane's value at the texel's centre. Each sheet is made so:

1. *Seed.* In one block of texels, candidates are the exact disparity planes of the triangles found
   there, which fit whole walls at once, and constants, which fit whatever else there is. The best
   by the block itself are scored again on the 3 x 3 blocks around, and the best of these is taken.
2. *Grow.* The rectangle takes in the strip of texels next to one side, then the next side, while
   it stays full enough and the strip itself is not all but empty.
3. *Refit* by least squares in units of tolerance, kept if it captures no less; grow again.
4. *Capture* every fragment the plane may draw.

Blocks are visited in scan order. A sheet too small to be worth a quad is put off, and what is left
in the end is cut again, in larger blocks, where the scattered rest of foliage shares its quads.

*Order.* Ends of intervals rise with disparity, and a sheet takes all it may. So of two fragments of
one texel in different sheets, the nearer one lies on the nearer plane: the first of the two sheets
refused the other fragment, so its plane lies beyond that fragment's interval, on its own side.

*Infinity.* A plane must not fall below d = 0 where it is drawn, so a texel counts only where the
plane is not negative anywhere in its (slightly grown) square.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.fit import fit_plane
from farfield_worker.slanted.grid import Grid, count_texels, match, texel_starts, value

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True)
class SegmentSettings:
    """Knobs of the segmentation.

    Attributes:
        fill: least share of a rectangle's texels that a growing sheet must capture.
        strip: least share of a strip's texels for it to be taken in.
        blocks: edge of the seeding blocks of each pass, texels.
        least: texels a sheet needs in each pass; the last is 1, so that nothing is left.
        seeds: how many candidates are scored on the blocks around.
    """

    fill: float = 0.5
    strip: float = 0.15
    blocks: tuple[int, ...] = (8, 16)
    least: tuple[int, ...] = (32, 1)
    seeds: int = 8


class Sheets(NamedTuple):
    """Sheets of one face.

    Attributes:
        rect: (s, 4) int32, first column, first row, end column, end row.
        plane: (s, 3) float, a, b, c.
        owner: (n,) int32, the sheet that captured each fragment, -1 if none.
    """

    rect: Ints
    plane: Floats
    owner: Ints


def segment(
    texel: Ints,
    disparity: Floats,
    low: Floats,
    high: Floats,
    seed: Ints,
    planes: Floats,
    resolution: int,
    settings: SegmentSettings | None = None,
) -> Sheets:
    """Cut fragments, sorted by texel, into sheets; every fragment ends in exactly one.

    `texel` (n,) is row * resolution + column; `low`, `high` (n,) the interval around `disparity`
    (n,), 1/m, with high > 0; `seed` (n,) the row of `planes` (m, 3) of the triangle it shows, whose
    rows may be nan.
    """
    knobs = settings or SegmentSettings()
    n = len(texel)
    owner = np.full(n, -1, np.int32)
    rects = np.zeros((n, 4), np.int32)
    sheet_planes = np.zeros((n, 3))
    grid = Grid(
        texel_starts(texel, resolution),
        disparity.astype(np.float64),
        low.astype(np.float64),
        high.astype(np.float64),
        owner,
        resolution,
    )
    count = 0
    for block, least in zip(knobs.blocks, knobs.least, strict=True):
        count = _pass(
            grid,
            seed.astype(np.int32),
            np.ascontiguousarray(planes, np.float64),
            rects,
            sheet_planes,
            count,
            block,
            least,
            knobs.fill,
            knobs.strip,
            knobs.seeds,
        )
    return Sheets(rects[:count].copy(), sheet_planes[:count].copy(), owner)


@njit(cache=True)
def _grow(grid: Any, plane: Any, rect: Any, fill: float, strip: float) -> int:
    """Grow `rect` in place as far as it stays full; return the texels the plane captures."""
    resolution = grid.resolution
    total = count_texels(grid, plane, rect[0], rect[1], rect[2], rect[3])
    refused = 0
    side = 0
    while refused < 4:
        x0, y0, x1, y1 = rect[0], rect[1], rect[2], rect[3]
        if side == 0:
            x1, x0 = x0, x0 - 1
        elif side == 1:
            y1, y0 = y0, y0 - 1
        elif side == 2:
            x0, x1 = x1, x1 + 1
        else:
            y0, y1 = y1, y1 + 1
        grown = False
        if x0 >= 0 and y0 >= 0 and x1 <= resolution and y1 <= resolution:
            found = count_texels(grid, plane, x0, y0, x1, y1)
            area = (x1 - x0) * (y1 - y0)
            whole = (rect[2] - rect[0]) * (rect[3] - rect[1]) + area
            if found >= strip * area and found > 0 and total + found >= fill * whole:
                rect[0], rect[1] = min(rect[0], x0), min(rect[1], y0)
                rect[2], rect[3] = max(rect[2], x1), max(rect[3], y1)
                total += found
                grown = True
        refused = 0 if grown else refused + 1
        side = (side + 1) % 4
    return total


@njit(cache=True)
def _shrink(grid: Any, plane: Any, rect: Any) -> int:
    """Shrink `rect` in place to the texels the plane captures; return how many."""
    left, top, right, bottom, total = rect[2], rect[3], rect[0], rect[1], 0
    for y in range(rect[1], rect[3]):
        for x in range(rect[0], rect[2]):
            if match(grid, x, y, plane[0], plane[1], plane[2]) >= 0:
                left, right = min(left, x), max(right, x + 1)
                top, bottom = min(top, y), max(bottom, y + 1)
                total += 1
    rect[0], rect[1], rect[2], rect[3] = left, top, right, bottom
    return total


@njit(cache=True)
def _capture(grid: Any, plane: Any, rect: Any, sheet: int) -> None:
    """Give every fragment that the plane may draw inside `rect` to `sheet`."""
    for y in range(rect[1], rect[3]):
        for x in range(rect[0], rect[2]):
            f = match(grid, x, y, plane[0], plane[1], plane[2])
            while f >= 0:
                grid.owner[f] = sheet
                f = match(grid, x, y, plane[0], plane[1], plane[2])


@njit(cache=True)
def _best_seed(
    grid: Any, seed: Any, planes: Any, done: Any, rect: Any, seeds: int, block: int, out: Any
) -> bool:
    """Write the best candidate plane of the block `rect` to `out`; False if nothing is left."""
    resolution = grid.resolution
    x0, y0, x1, y1 = rect[0], rect[1], rect[2], rect[3]
    most = 4 * (x1 - x0) * (y1 - y0) + 8
    candidates = np.empty((most, 3))
    scores = np.zeros(most, np.int64)
    depths = np.empty(most)
    count = 0
    found = 0
    for y in range(y0, y1):
        for x in range(x0, x1):
            cell = y * resolution + x
            for f in range(grid.starts[cell], grid.starts[cell + 1]):
                if grid.owner[f] >= 0 or done[f]:
                    continue
                if found < most:
                    depths[found] = grid.disparity[f]
                    found += 1
                known = np.isnan(planes[seed[f], 0])
                k = 0
                while k < count and not known:
                    known = (
                        candidates[k, 0] == planes[seed[f], 0]
                        and candidates[k, 1] == planes[seed[f], 1]
                        and candidates[k, 2] == planes[seed[f], 2]
                    )
                    k += 1
                if not known and count < most - 8:
                    candidates[count] = planes[seed[f]]
                    count += 1
    if found == 0:
        return False
    depths = np.sort(depths[:found])
    for k in range(min(found, 5)):
        candidates[count, 0] = candidates[count, 1] = 0.0
        candidates[count, 2] = depths[(2 * k + 1) * found // (2 * min(found, 5))]
        count += 1
    for k in range(count):
        scores[k] = _count_new(grid, done, candidates[k], rect)
    best, best_score = -1, 0
    ax0, ay0 = max(x0 - block, 0), max(y0 - block, 0)
    ax1, ay1 = min(x1 + block, resolution), min(y1 + block, resolution)
    for _ in range(min(seeds, count)):
        k = int(np.argmax(scores[:count]))
        if scores[k] <= 0:
            break
        score = count_texels(grid, candidates[k], ax0, ay0, ax1, ay1)
        scores[k] = 0
        if score > best_score:
            best, best_score = k, score
    out[0], out[1], out[2] = candidates[best, 0], candidates[best, 1], candidates[best, 2]
    return True


@njit(cache=True)
def _pass(
    grid: Any,
    seed: Any,
    planes: Any,
    rects: Any,
    sheet_planes: Any,
    count: int,
    block: int,
    least: int,
    fill: float,
    strip: float,
    seeds: int,
) -> int:
    """One scan over all blocks; sheets of at least `least` texels are appended."""
    resolution = grid.resolution
    done = np.zeros(len(seed), np.bool_)
    plane, other, first = np.empty(3), np.empty(3), np.empty(3)
    square, rect, wider = np.empty(4, np.int32), np.empty(4, np.int32), np.empty(4, np.int32)
    for by in range(0, resolution, block):
        for bx in range(0, resolution, block):
            square[0], square[1] = bx, by
            square[2], square[3] = min(bx + block, resolution), min(by + block, resolution)
            while _best_seed(grid, seed, planes, done, square, seeds, block, plane):
                first[:] = plane
                rect[:] = square
                _shrink(grid, plane, rect)
                texels = _grow(grid, plane, rect, fill, strip)
                if fit_plane(grid, rect, plane, other):
                    wider[:] = rect
                    if count_texels(grid, other, wider[0], wider[1], wider[2], wider[3]) >= texels:
                        texels = _grow(grid, other, wider, fill, strip)
                        rect[:] = wider
                        plane[:] = other
                texels = _shrink(grid, plane, rect)
                if texels >= least:
                    _capture(grid, plane, rect, count)
                    rects[count] = rect
                    sheet_planes[count] = plane
                    count += 1
                else:
                    _put_off(grid, first, square, done)
    return count


@njit(cache=True)
def _count_new(grid: Any, done: Any, plane: Any, square: Any) -> int:
    """Fragments of `square` not yet put off that the plane may draw."""
    a, b, c = plane[0], plane[1], plane[2]
    total = 0
    for y in range(square[1], square[3]):
        for x in range(square[0], square[2]):
            if match(grid, x, y, a, b, c) < 0:
                continue
            d = value(grid.resolution, x, y, a, b, c)
            cell = y * grid.resolution + x
            for f in range(grid.starts[cell], grid.starts[cell + 1]):
                if grid.owner[f] < 0 and not done[f] and grid.low[f] <= d <= grid.high[f]:
                    total += 1
    return total


@njit(cache=True)
def _put_off(grid: Any, plane: Any, square: Any, done: Any) -> None:
    """Mark what the plane may draw inside `square`, so that it seeds no more in this pass."""
    a, b, c = plane[0], plane[1], plane[2]
    for y in range(square[1], square[3]):
        for x in range(square[0], square[2]):
            if match(grid, x, y, a, b, c) < 0:
                continue
            d = value(grid.resolution, x, y, a, b, c)
            cell = y * grid.resolution + x
            for f in range(grid.starts[cell], grid.starts[cell + 1]):
                if grid.owner[f] < 0 and grid.low[f] <= d <= grid.high[f]:
                    done[f] = True
