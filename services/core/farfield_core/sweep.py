"""Which cells of a lattice a path's swept volume overlaps.

Everything is in lattice units: cell (i, j, k) is the box from (i, j, k) to (i + 1, j + 1, k + 1).
The volume is an upright elliptic cylinder swept along a polyline: at point p it covers
((x - p.x) / rx)^2 + ((z - p.z) / rz)^2 <= 1 and p.y <= y <= p.y + height. A column overlaps a
segment where the segment runs inside the column's square grown by the ellipse: two rectangles and
four ellipses at the corners, together convex, so one interval of the segment's parameter t. The
heights swept over that interval are an interval too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_core.errors import BadInputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: volumes that only touch do not overlap: everything is shrunk by this share
_SHRINK = 1e-6
#: segments are taken in pieces of this many cells, so that long diagonals stay cheap
_PIECE = 16.0
#: (piece, column) pairs looked at together
_BATCH = 1 << 20


@dataclass(frozen=True)
class Visits:
    """Cells or columns that the swept volume overlaps.

    Attributes:
        index: (n, 3) int32, lattice indices; j = 0 for columns.
        along: (n,) float, how far along the path their centres are passed.
        aside: (n,) float, distance of their centres from the path, seen from above.
        floor: (n,) float, the path's y there.
    """

    index: NDArray[np.int32]
    along: Floats
    aside: Floats
    floor: Floats

    def take(self, rows: Ints) -> Visits:
        """The visits `rows`."""
        return Visits(self.index[rows], self.along[rows], self.aside[rows], self.floor[rows])


class _Crossings(NamedTuple):
    """Columns crossed by pieces, in the order of the path; all (n,)."""

    i: Ints
    k: Ints
    low: Floats  # lowest and highest y of the path's floor over the column
    high: Floats
    along: Floats
    aside: Floats
    floor: Floats


def swept_cells(points: Floats, radius: tuple[float, float], height: float, limit: int) -> Visits:
    """Cells overlapped by the volume swept along `points` (n, 3), each once.

    Raises BadInputError where that would be many more than `limit` cells.
    """
    _check_extent(points, radius, height, limit)
    found = []
    for c in _crossings(points, radius, limit):
        low = np.floor(c.low + _SHRINK * height).astype(np.int64)
        high = np.ceil(c.high + (1 - _SHRINK) * height).astype(np.int64) - 1
        high = np.maximum(high, low)
        storeys = high - low + 1
        if storeys.sum() > 8 * limit:
            raise _too_many(limit)
        row = np.repeat(np.arange(len(low)), storeys)
        j = np.arange(len(row)) - np.repeat(np.cumsum(storeys) - storeys, storeys) + low[row]
        index = np.stack([c.i[row], j, c.k[row]], axis=1).astype(np.int32)
        found.append(_first(Visits(index, c.along[row], c.aside[row], c.floor[row])))
        if sum(len(f.index) for f in found) > 8 * limit:
            found = [_first(_join(found))]
    return _first(_join(found))


def swept_columns(points: Floats, radius: tuple[float, float], limit: int) -> Visits:
    """Columns overlapped by the volume swept along `points` (n, 3), once for each piece of path.

    Raises BadInputError where that would be many more than `limit` columns.
    """
    _check_extent(points, radius, 0.0, limit)
    found = []
    for c in _crossings(points, radius, limit):
        index = np.stack([c.i, np.zeros_like(c.i), c.k], axis=1).astype(np.int32)
        found.append(Visits(index, c.along, c.aside, c.floor))
        if sum(len(f.index) for f in found) > 8 * limit:
            raise _too_many(limit)
    return _join(found)


def _too_many(limit: int) -> BadInputError:
    return BadInputError(
        f"The corridor has more than {limit} cells; use larger cells or a smaller corridor."
    )


def _check_extent(points: Floats, radius: tuple[float, float], height: float, limit: int) -> None:
    """A path visits at least as many cells as it is long on any axis, and as it is wide."""
    reach = np.ptp(points, axis=0) + 2 * np.array([radius[0], height / 2, radius[1]])
    if (reach > limit).any() or 4 * radius[0] * radius[1] * max(height, 1.0) > 2 * limit:
        raise _too_many(limit)


def _join(parts: list[Visits]) -> Visits:
    return Visits(
        np.concatenate([part.index for part in parts]),
        np.concatenate([part.along for part in parts]),
        np.concatenate([part.aside for part in parts]),
        np.concatenate([part.floor for part in parts]),
    )


def _first(visits: Visits) -> Visits:
    """The first visit of every cell; visits come in the order of the path."""
    low = visits.index.min(axis=0).astype(np.int64)
    span = visits.index.max(axis=0) - low + 1
    i, j, k = (visits.index - low).T
    key = (i * span[1] + j) * span[2] + k
    _, first = np.unique(key, return_index=True)
    return visits.take(first.astype(np.int64))


def _pieces(points: Floats, limit: int) -> tuple[Floats, Floats, Floats]:
    """Starts, ends (n, 3) and arc lengths at the start (n,) of short pieces of the polyline."""
    if len(points) == 1:
        return points, points, np.zeros(1)
    start, step = points[:-1], np.diff(points, axis=0)
    length = np.hypot(step[:, 0], step[:, 2])
    arc = np.concatenate(([0.0], np.cumsum(length)[:-1]))
    parts = np.maximum(np.ceil(length / _PIECE), 1.0)
    if parts.sum() > 8 * limit:
        raise _too_many(limit)
    count = parts.astype(np.int64)
    row = np.repeat(np.arange(len(start)), count)
    nth = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    t0, t1 = nth / count[row], (nth + 1) / count[row]
    return (
        start[row] + t0[:, None] * step[row],
        start[row] + t1[:, None] * step[row],
        arc[row] + t0 * length[row],
    )


def _crossings(points: Floats, radius: tuple[float, float], limit: int) -> Iterator[_Crossings]:
    """Columns that pieces overlap, batch by batch along the path."""
    start, end, arc = _pieces(points, limit)
    r = np.array([radius[0], radius[1]])
    plan = [0, 2]
    low = np.floor(np.minimum(start, end)[:, plan] - r).astype(np.int64)
    high = np.floor(np.maximum(start, end)[:, plan] + r).astype(np.int64)
    shape = high - low + 1
    pairs = shape.prod(axis=1)
    if pairs.sum() > 200 * limit:
        raise _too_many(limit)
    # a batch is a run of pieces with about _BATCH pairs
    batch = (np.cumsum(pairs) - pairs) // _BATCH
    for run in np.split(np.arange(len(pairs)), np.flatnonzero(np.diff(batch)) + 1):
        piece = np.repeat(run, pairs[run])
        nth = np.arange(len(piece)) - np.repeat(np.cumsum(pairs[run]) - pairs[run], pairs[run])
        column = low[piece] + np.stack(np.divmod(nth, shape[piece, 1]), axis=1)
        p, step = start[piece], (end - start)[piece]
        t0, t1 = _inside(column, p[:, plan], step[:, plan], r)
        hit = t0 <= t1
        column, p, step, t0, t1 = column[hit], p[hit], step[hit], t0[hit], t1[hit]
        y0, y1 = p[:, 1] + t0 * step[:, 1], p[:, 1] + t1 * step[:, 1]
        flat = step[:, plan]
        length2 = (flat**2).sum(axis=1)
        to_centre = column + 0.5 - p[:, plan]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(length2 > 0, (to_centre * flat).sum(axis=1) / length2, 0.0)
        t = np.clip(t, 0.0, 1.0)
        yield _Crossings(
            i=column[:, 0],
            k=column[:, 1],
            low=np.minimum(y0, y1),
            high=np.maximum(y0, y1),
            # rounded, so that what is level sorts as level
            along=np.round(arc[piece[hit]] + t * np.sqrt(length2), 6),
            aside=np.round(np.hypot(*(to_centre - t[:, None] * flat).T), 6),
            floor=p[:, 1] + t * step[:, 1],
        )


def _inside(column: Ints, p: Floats, step: Floats, r: Floats) -> tuple[Floats, Floats]:
    """Interval of t in [0, 1] where p + t step lies in the column's grown square.

    All arguments but `r` (2,) are (n, 2), x and z; returns two (n,), empty where the first is
    greater than the second.
    """
    r = r * (1 - _SHRINK)
    square = (column.astype(np.float64) - p, column + 1.0 - p)
    t0, t1 = np.full(len(p), np.inf), np.full(len(p), -np.inf)
    for grown in (np.array([r[0], 0.0]), np.array([0.0, r[1]])):
        # the bare square's sides shrink too, or a path along a cell's face would visit both
        shrink = np.where(grown == 0, _SHRINK, 0.0)
        a0, a1 = _slab(square[0] - grown + shrink, square[1] + grown - shrink, step)
        ok = a0 <= a1
        t0, t1 = np.where(ok, np.minimum(t0, a0), t0), np.where(ok, np.maximum(t1, a1), t1)
    for x in square:
        for z in square:
            a0, a1 = _disc(np.stack([x[:, 0], z[:, 1]], axis=1) / r, step / r)
            ok = a0 <= a1
            t0, t1 = np.where(ok, np.minimum(t0, a0), t0), np.where(ok, np.maximum(t1, a1), t1)
    return t0, t1


def _slab(low: Floats, high: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Interval of t in [0, 1] with low <= t step <= high on both axes."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = low / step, high / step
    still = step == 0
    inside = (low <= 0) & (high >= 0)
    near = np.where(still, np.where(inside, -np.inf, np.inf), np.minimum(a, b))
    far = np.where(still, np.where(inside, np.inf, -np.inf), np.maximum(a, b))
    return np.maximum(near.max(axis=1), 0.0), np.minimum(far.min(axis=1), 1.0)


def _disc(centre: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Interval of t in [0, 1] with |t step - centre| <= 1."""
    a = (step**2).sum(axis=1)
    b = (step * centre).sum(axis=1)
    c = (centre**2).sum(axis=1) - 1.0
    root = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.sqrt(root)
        near, far = (b - half) / a, (b + half) / a
    still = a == 0
    near = np.where(still, np.where(c <= 0, 0.0, np.inf), np.where(root >= 0, near, np.inf))
    far = np.where(still, np.where(c <= 0, 1.0, -np.inf), np.where(root >= 0, far, -np.inf))
    return np.maximum(near, 0.0), np.minimum(far, 1.0)
