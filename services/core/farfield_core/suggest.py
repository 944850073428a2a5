"""A corridor for a model that nobody has made one for: a short, straight walk in a good place.

Vertical lines on a grid over the scene's middle find floors: walkable surfaces with room for a
walker above. Outdoors, where much of the ground lies open to the sky, only open floors count;
indoors the lowest floor with a ceiling does. Straight runs over neighbouring floors are ranked by
their length, by what there is to see around them and by how central they are; the first that is
level when looked at closely is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farfield_core.corridor import Corridor, Floats, Path_
from farfield_core.ground import UPRIGHT, surfaces
from farfield_core.scene import Bounds, PreparedScene

#: metres
_EYE = 1.7
_CELL = 10.0
#: share of the scene's smaller width that a cell may have
_CELL_SHARE = 0.04
#: cells that a suggested walk is long
_LENGTH = 12
#: vertical lines along each side of the part that is looked at
_LINES = 48
#: share of lines open to the sky from which a scene is taken for outdoors
_OPEN = 0.3
#: runs looked at closely, how many at a time, and points along each
_CLOSELY = 2048
_AT_ONCE = 128
_POINTS = 49


@dataclass(frozen=True)
class Suggestion:
    """A corridor and the edge length of its cells."""

    corridor: Corridor
    cell_size: float


@dataclass(frozen=True)
class Scale:
    """How large a walker is in a scene: height of the eye, edge length of a cell."""

    eye: float
    cell: float


def suggest_corridor(scene: PreparedScene) -> Suggestion:
    """A corridor of a dozen cells through `scene`, and their edge length."""
    bounds = scene.info.bounds
    scale = guess_scale(bounds)
    points = _walk(scene, scale)
    path = Path_(
        points=tuple((float(x), float(y), float(z)) for x, y, z in points),
        width=0.8 * scale.cell,
        height=max(1.2 * scale.eye, 0.5 * scale.cell),
    )
    corridor = Corridor(path=path, follow_ground=True, eye_height=scale.eye)
    return Suggestion(corridor, scale.cell)


def guess_scale(bounds: Bounds) -> Scale:
    """Guess the size of a walker.

    What is over 500 m high, and more than a tenth as high as it is wide, is taken for a room in
    millimetres; in what is only a few metres large the walker shrinks with it.
    """
    width, height, depth = (b - a for a, b in zip(bounds.min, bounds.max, strict=True))
    unit = 1000.0 if height > 500 and height > 0.1 * max(width, depth) else 1.0
    across = max(min(width, depth), 0.05 * max(width, depth, height), 1e-6)
    cell = min(_CELL * unit, _CELL_SHARE * across)
    return Scale(eye=min(_EYE * unit, 0.7 * height or cell), cell=cell)


def _walk(scene: PreparedScene, scale: Scale) -> Floats:
    """Points (n, 3) of the walk."""
    bounds = scene.info.bounds
    x, z = (_lines(bounds.min[axis], bounds.max[axis], scale) for axis in (0, 2))
    grid_x, grid_z = (grid.ravel() for grid in np.meshgrid(x, z, indexing="ij"))
    floor = _floors(scene, grid_x, grid_z, scale).reshape(len(x), len(z))
    runs = _ranked_runs(x, z, floor, scale)
    for first in range(0, min(len(runs), _CLOSELY), _AT_ONCE):
        found = _first_level(scene, runs[first : first + _AT_ONCE], scale)
        if found is not None:
            return found
    return _across_the_middle(bounds, floor, scale)


def _first_level(
    scene: PreparedScene, runs: list[tuple[Floats, Floats]], scale: Scale
) -> Floats | None:
    """Points (n, 3) along the first run without a gap or a step."""
    t = np.linspace(0, 1, _POINTS)
    lines = np.array([a + t[:, None] * (b - a) for a, b in runs])
    floors = _floors(scene, lines[..., 0].ravel(), lines[..., 1].ravel(), scale)
    for line, y in zip(lines, floors.reshape(len(runs), -1), strict=True):
        step = float(np.hypot(*(line[1] - line[0])))
        # NaN compares false: a gap is not level either
        if (np.abs(np.diff(y)) < 0.5 * step + 0.2 * scale.eye).all():
            some = slice(None, None, 4)
            return np.stack([line[some, 0], y[some], line[some, 1]], axis=1)
    return None


def _across_the_middle(bounds: Bounds, floor: Floats, scale: Scale) -> Floats:
    """A walk across the middle of a scene that has nowhere to walk."""
    low, high = np.array(bounds.min), np.array(bounds.max)
    middle = (low + high) / 2
    if np.isfinite(floor).any():
        middle[1] = np.nanmedian(floor)
    reach = min(_LENGTH * scale.cell, 0.8 * float(high[0] - low[0])) / 2
    along = np.array([reach, 0, 0])
    return np.stack([middle - along, middle + along])


def _lines(low: float, high: float, scale: Scale) -> Floats:
    """Coordinates of lines over the middle of an interval, at most two cells apart."""
    reach = min(0.4 * (high - low), _LINES * scale.cell)
    return (low + high) / 2 + np.linspace(-reach, reach, _LINES)


def _floors(scene: PreparedScene, x: Floats, z: Floats, scale: Scale) -> Floats:
    """Height of the floor on each vertical line (n,), NaN where there is none."""
    hits = surfaces(scene, x, z)
    top = np.ones(len(hits.line), bool)
    top[:-1] = hits.line[1:] != hits.line[:-1]
    room = np.full(len(hits.line), np.inf)
    room[:-1] = np.where(top[:-1], np.inf, hits.y[1:] - hits.y[:-1])
    # the undersides of solids face down; a model wound the wrong way round has nothing else
    flat = hits.up > UPRIGHT
    if not flat.any():
        flat = hits.up < -UPRIGHT
    floors = flat & (room > 1.1 * scale.eye)
    open_floors = floors & top
    if open_floors.sum() > _OPEN * len(x) and not _are_roofs(open_floors, floors):
        floors = open_floors
    lowest = np.full(len(x), np.nan)
    line, first = np.unique(hits.line[floors], return_index=True)
    lowest[line] = hits.y[floors][first]
    return lowest


def _are_roofs(open_floors: NDArray[np.bool_], floors: NDArray[np.bool_]) -> bool:
    """Whether what lies open to the sky is mostly roofs of rooms."""
    covered = floors & ~open_floors
    return bool(covered.sum() > 0.7 * open_floors.sum())


def _ranked_runs(x: Floats, z: Floats, floor: Floats, scale: Scale) -> list[tuple[Floats, Floats]]:
    """Starts and ends, each (x, z), of straight runs over floors, the best first."""
    look = _variety(floor)
    found: list[tuple[float, Floats, Floats]] = []
    for di, dk in ((1, 0), (0, 1), (1, 1), (1, -1)):
        step = float(np.hypot(di * (x[1] - x[0]), dk * (z[1] - z[0])))
        if step == 0:  # a scene without any width
            continue
        steps = max(1, int(np.ceil(_LENGTH * scale.cell / step)))
        for i in range(len(x)):
            for k in range(len(z)):
                rows, columns = i + di * np.arange(steps + 1), k + dk * np.arange(steps + 1)
                inside = (rows < len(x)) & (columns >= 0) & (columns < len(z))
                rows, columns = rows[inside], columns[inside]
                y = floor[rows, columns]
                level = np.abs(np.diff(y)) < 0.35 * step
                good = len(level) if level.all() else int(np.argmin(level))
                if good == 0:
                    continue
                rows, columns = rows[: good + 1], columns[: good + 1]
                reach = min(1.0, _LENGTH * scale.cell / (good * step))
                start = np.array([x[rows[0]], z[columns[0]]])
                end = start + reach * (np.array([x[rows[-1]], z[columns[-1]]]) - start)
                off = np.hypot(rows.mean() / len(x) - 0.5, columns.mean() / len(z) - 0.5)
                length = min(1.0, good / steps)
                found.append((2 * length + look[rows, columns].mean() - off, start, end))
    found.sort(key=lambda run: -run[0])
    return [(start, end) for _, start, end in found]


def _variety(floor: Floats) -> Floats:
    """How much there is to see around each line, 0 to 1: most where every other one is blocked."""
    step = np.abs(np.diff(floor, axis=0, append=floor[-1:]))
    blocked = ~np.isfinite(floor) | ~(step < 0.1 * np.nanmax(np.append(step, 1e-9)))
    padded = np.pad(blocked.astype(np.float64), 3, mode="edge")
    share = np.zeros(floor.shape)
    for i in range(7):
        for k in range(7):
            share += padded[i : i + floor.shape[0], k : k + floor.shape[1]] / 49
    return 1 - np.abs(2 * share - 1)
