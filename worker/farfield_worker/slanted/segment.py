"""Cut the fragments of one face into sheets: sets of texels that one disparity plane can draw.

Every fragment allows an interval of disparities (slanted/tolerance.py). A *sheet* is a rectangle of
texels, a plane d = a u + b v + c, and the fragments it has captured: at each of its texels those,
not yet taken, whose interval holds the plane's value at the texel's centre. Each sheet is made so:

1. *Seed.* In one block of texels, candidates are the exact disparity planes of the triangles found
   there, which fit whole walls at once, and constants, which fit whatever else there is. The one
   that may draw most of the block's fragments is taken. (To score on the 3 x 3 blocks around was
   tried: no fewer quads, for three times the time.)
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
from farfield_worker.slanted.grid import GROWTH, Grid, count_texels, match, texel_starts

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


#: how many constants are tried in a block
CONSTANTS = 5


@dataclass(frozen=True)
class SegmentSettings:
    """Knobs of the segmentation.

    Attributes:
        fill: least share of a rectangle's texels that a growing sheet must capture.
        strip: least share of a strip's texels for it to be taken in.
        blocks: edge of the seeding blocks of each pass, texels.
        least: texels a sheet needs in each pass; the last is 1, so that nothing is left.
        largest: longest edge of a sheet, texels: what an atlas page takes.
        seeds: how many triangles' planes are tried in a block, those that show most often.
    """

    fill: float = 0.35
    strip: float = 0.05
    blocks: tuple[int, ...] = (8, 16)
    least: tuple[int, ...] = (32, 1)
    largest: int = 1020
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

    def take(self, keep: NDArray[np.bool_]) -> Sheets:
        """Only the sheets in `keep` (s,); fragments of the others are captured by none."""
        # with one more for the owner -1
        number = np.append(np.where(keep, np.cumsum(keep) - 1, -1), -1).astype(np.int32)
        return Sheets(self.rect[keep], self.plane[keep], number[self.owner])


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
            knobs.largest,
            knobs.seeds,
        )
    return Sheets(rects[:count].copy(), sheet_planes[:count].copy(), owner)


@njit(cache=True)
def _strip(grid: Any, plane: Any, rect: Any, side: int) -> int:
    """Texels that the plane captures in the strip next to `side` of `rect`: left, top and so on."""
    x0, y0, x1, y1 = rect[0], rect[1], rect[2], rect[3]
    if side == 0:
        return int(count_texels(grid, plane, x0 - 1, y0, x0, y1))
    if side == 1:
        return int(count_texels(grid, plane, x0, y0 - 1, x1, y0))
    if side == 2:
        return int(count_texels(grid, plane, x1, y0, x1 + 1, y1))
    return int(count_texels(grid, plane, x0, y1, x1, y1 + 1))


@njit(cache=True)
def _grow(grid: Any, plane: Any, rect: Any, fill: float, strip: float, largest: int) -> int:
    """Grow `rect` in place as far as it stays full; return the texels the plane captures.

    What the strips next to all sides capture is kept up to date: when one side grows, the two
    strips beside it get one texel longer.
    """
    resolution = grid.resolution
    total = count_texels(grid, plane, rect[0], rect[1], rect[2], rect[3])
    found = np.zeros(4, np.int64)
    for side in range(4):
        found[side] = _strip(grid, plane, rect, side)
    refused = 0
    side = 0
    while refused < 4:
        across = side % 2  # 0: the strip is a column, 1: a row
        length, breadth = rect[3 - across] - rect[1 - across], rect[2 + across] - rect[across]
        room = rect[side] > 0 if side < 2 else rect[side] < resolution
        grown = False
        if room and breadth < largest and found[side] > 0 and found[side] >= strip * length:
            grown = total + found[side] >= fill * (breadth + 1) * length
        if grown:
            total += found[side]
            # the texels that the strips beside this one gain
            along = rect[side] - 1 if side < 2 else rect[side]
            for other in (1 - across, 3 - across):
                beside = rect[other] - 1 if other < 2 else rect[other]
                x, y = (along, beside) if across == 0 else (beside, along)
                found[other] += count_texels(grid, plane, x, y, x + 1, y + 1)
            rect[side] += -1 if side < 2 else 1
            found[side] = _strip(grid, plane, rect, side)
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
                grid.low[f] = np.inf
                f = match(grid, x, y, plane[0], plane[1], plane[2])


@njit(cache=True)
def _gather(grid: Any, done: Any, square: Any, fragments: Any, places: Any) -> int:
    """Write the fragments of `square` that may seed, and their (u, v); return how many."""
    resolution = grid.resolution
    size = 2.0 / resolution
    count = 0
    for y in range(square[1], square[3]):
        for x in range(square[0], square[2]):
            cell = y * resolution + x
            for f in range(grid.starts[cell], grid.starts[cell + 1]):
                if grid.owner[f] < 0 and not done[f]:
                    fragments[count] = f
                    places[count, 0] = (x + 0.5) * size - 1.0
                    places[count, 1] = (y + 0.5) * size - 1.0
                    count += 1
    return count


@njit(cache=True)
def _candidates(grid: Any, seed: Any, planes: Any, fragments: Any, tally: Any, out: Any) -> int:
    """Write candidate planes for `fragments` to `out`; return how many.

    The planes of the triangles that show most often, at most `len(out) - CONSTANTS` of them, then
    constants at evenly spaced quantiles of disparity. `tally` is scratch: a zero per plane.
    """
    most = len(out) - CONSTANTS
    rows, times = np.empty(most, np.int32), np.empty(most, np.int32)
    count = 0
    for f in fragments:
        tally[seed[f]] += 1
    for f in fragments:
        row = seed[f]
        shown = tally[row]
        tally[row] = 0
        if shown == 0 or np.isnan(planes[row, 0]):
            continue
        k = count
        while k > 0 and times[k - 1] < shown:
            if k < most:
                times[k], rows[k] = times[k - 1], rows[k - 1]
            k -= 1
        if k < most:
            times[k], rows[k] = shown, row
            count = min(count + 1, most)
    for k in range(count):
        out[k] = planes[rows[k]]
    depths = np.sort(grid.disparity[fragments])
    constants = min(len(depths), CONSTANTS)
    for k in range(constants):
        out[count, 0] = out[count, 1] = 0.0
        out[count, 2] = depths[(2 * k + 1) * len(depths) // (2 * constants)]
        count += 1
    return count


@njit(cache=True, inline="always")
def _fits(grid: Any, plane: Any, f: int, u: float, v: float) -> bool:
    """Whether `plane` may draw fragment f, seen at (u, v)."""
    d = plane[0] * u + plane[1] * v + plane[2]
    least = (abs(plane[0]) + abs(plane[1])) * (1.0 + 2.0 * GROWTH) / grid.resolution
    return bool(d >= least and grid.low[f] <= d <= grid.high[f])


@njit(cache=True)
def _best(grid: Any, candidates: Any, fragments: Any, places: Any, out: Any) -> None:
    """Write to `out` the candidate that may draw most of `fragments`, seen at `places`."""
    most = 0
    for k in range(len(candidates)):
        score = 0
        for i in range(len(fragments)):
            if score + len(fragments) - i <= most:
                break
            if _fits(grid, candidates[k], fragments[i], places[i, 0], places[i, 1]):
                score += 1
        if score > most:
            most = score
            out[:] = candidates[k]


@njit(cache=True)
def _make_sheet(grid: Any, plane: Any, rect: Any, fill: float, strip: float, largest: int) -> int:
    """Grow, refit and shrink `plane` and `rect` in place; return the texels it captures."""
    _shrink(grid, plane, rect)
    texels = _grow(grid, plane, rect, fill, strip, largest)
    other = np.empty(3)
    if (
        fit_plane(grid, rect, plane, other)
        and count_texels(grid, other, rect[0], rect[1], rect[2], rect[3]) >= texels
    ):
        plane[:] = other
        _grow(grid, plane, rect, fill, strip, largest)
    return _shrink(grid, plane, rect)


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
    largest: int,
    seeds: int,
) -> int:
    """One scan over all blocks; sheets of at least `least` texels are appended."""
    resolution = grid.resolution
    done = np.zeros(len(seed), np.bool_)
    tally = np.zeros(len(planes), np.int32)
    candidates = np.empty((seeds + CONSTANTS, 3))
    plane, first = np.empty(3), np.empty(3)
    square, rect = np.empty(4, np.int32), np.empty(4, np.int32)
    for by in range(0, resolution, block):
        for bx in range(0, resolution, block):
            square[0], square[1] = bx, by
            square[2], square[3] = min(bx + block, resolution), min(by + block, resolution)
            crowd = 0
            for y in range(square[1], square[3]):
                row = y * resolution
                crowd += grid.starts[row + square[2]] - grid.starts[row + square[0]]
            fragments, places = np.empty(crowd, np.int32), np.empty((crowd, 2))
            while True:
                crowd = _gather(grid, done, square, fragments, places)
                if crowd == 0:
                    break
                part = fragments[:crowd]
                k = _candidates(grid, seed, planes, part, tally, candidates)
                _best(grid, candidates[:k], part, places, first)
                plane[:] = first
                rect[:] = square
                if _make_sheet(grid, plane, rect, fill, strip, largest) >= least:
                    _capture(grid, plane, rect, count)
                    rects[count] = rect
                    sheet_planes[count] = plane
                    count += 1
                    continue
                for i in range(crowd):
                    if _fits(grid, first, part[i], places[i, 0], places[i, 1]):
                        done[part[i]] = True
    return count
