"""Cutting corridors: against counting by brute force, and by properties."""

import itertools
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from farfield_core.cells import CellGrid
from farfield_core.corridor import Corridor, cut, parse_corridor, read_corridor
from farfield_core.errors import BadInputError
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Point = tuple[float, float, float]
lengths = st.floats(0.5, 20)
coordinates = st.floats(-40, 40)
points = st.tuples(coordinates, st.floats(-6, 6), coordinates)
sizes = st.tuples(st.floats(2, 10), st.floats(2, 10), st.floats(2, 10))


def path(*corners: Point, width: float, height: float, **more: Any) -> Corridor:
    return parse_corridor({"path": {"points": corners, "width": width, "height": height}, **more})


def box(low: tuple[float, ...], high: tuple[float, ...], **more: Any) -> Corridor:
    return parse_corridor({"box": {"min": low, "max": high}, **more})


def cells(grid: CellGrid) -> set[tuple[int, int, int]]:
    assert len(set(grid.indices())) == len(grid)
    return set(grid.indices())


def depth_in_sweep(corridor: Corridor, grid: CellGrid, index: tuple[int, int, int]) -> float:
    """How deep a cell reaches into the swept volume, at finely spaced points of the path, metres.

    Negative where it does not reach it.
    """
    assert corridor.path
    low = grid.origin + np.array(index) * grid.size
    high = low + grid.size
    corners = np.array(corridor.path.points)
    t = np.linspace(0, 1, 400)[:, None]
    best = -math.inf
    for p, q in itertools.pairwise([corners[0], *corners]):
        at = p + t * (q - p)
        away = np.maximum(np.maximum(low - at, at - high), 0)
        aside = corridor.path.width / 2 - np.hypot(away[:, 0], away[:, 2])
        above = np.minimum(high[1] - at[:, 1], at[:, 1] + corridor.path.height - low[1])
        best = max(best, float(np.minimum(aside, above).max()))
    return best


@given(st.lists(points, min_size=1, max_size=3), lengths, lengths, sizes)
def test_a_path_takes_the_cells_it_sweeps_and_no_other(
    corners: list[Point],
    width: float,
    height: float,
    size: Point,
) -> None:
    corridor = path(*corners, width=width, height=height)
    grid = cut(corridor, size)
    taken = cells(grid)
    low, high = grid.index.min(axis=0) - 1, grid.index.max(axis=0) + 2
    around = list(itertools.product(*(range(a, b) for a, b in zip(low, high, strict=True))))
    for index in around if len(around) < 60 else np.random.default_rng(0).permutation(around)[:60]:
        i, j, k = (int(n) for n in index)
        depth = depth_in_sweep(corridor, grid, (i, j, k))
        # the oracle's points are up to 0.3 m apart
        if abs(depth) > 0.35:
            assert ((i, j, k) in taken) == (depth > 0), ((i, j, k), depth)


@given(st.lists(points, min_size=1, max_size=4), lengths, sizes)
def test_a_path_begins_in_the_middle_of_its_first_cell(
    corners: list[Point], width: float, size: Point
) -> None:
    grid = cut(path(*corners, width=width, height=1.0), size)
    assert grid.indices()[0] == (0, 0, 0)
    expected = np.array(corners[0]) + np.array([0, size[1] / 2, 0])
    np.testing.assert_allclose(grid.centres()[0], expected, atol=1e-9)


@given(st.lists(points, min_size=2, max_size=5), lengths, sizes)
def test_a_longer_path_keeps_its_cells(corners: list[Point], width: float, size: Point) -> None:
    short = cut(path(*corners[:-1], width=width, height=2.0), size)
    long = cut(path(*corners, width=width, height=2.0), size)
    assert cells(short) <= cells(long)
    np.testing.assert_array_equal(short.origin, long.origin)


@given(st.lists(points, min_size=1, max_size=3), sizes, st.floats(-1e7, 1e7))
def test_far_from_the_origin_nothing_changes(corners: list[Point], size: Point, far: float) -> None:
    # shifts that are exact in binary
    far = float(round(far / 64) * 64)
    corners = [(float(round(x)), float(round(y)), float(round(z))) for x, y, z in corners]
    moved = [(x + far, y - far, z + 2 * far) for x, y, z in corners]
    here = cut(path(*corners, width=3, height=2), size)
    there = cut(path(*moved, width=3, height=2), size)
    assert len(here) == len(there)


def test_a_path_as_wide_as_a_cell_takes_one_row() -> None:
    grid = cut(path((0, 0, 0), (40, 0, 0), width=4, height=4), (4, 4, 4))
    assert grid.indices() == [(i, 0, 0) for i in range(11)]


def test_cells_come_in_the_order_of_the_walk() -> None:
    grid = cut(path((0, 0, 0), (40, 0, 0), (40, 0, 40), width=9, height=3), (4, 4, 4))
    centres = grid.centres()
    first_leg = (centres[:, 2] == 0) & (centres[:, 0] >= 0) & (centres[:, 0] <= 40)
    second_leg = (centres[:, 0] == 40) & (centres[:, 2] >= 0)
    assert first_leg.sum() == 11
    assert second_leg.sum() > 11
    assert (np.diff(centres[first_leg, 0]) > 0).all()
    assert (np.diff(centres[second_leg, 2]) > 0).all()


def test_stairs_are_climbed() -> None:
    grid = cut(path((0, 0, 0), (30, 15, 0), width=2, height=2), (3, 3, 3))
    tops = {int(i): 0 for i in grid.index[:, 0]}
    for i, j, _ in grid.indices():
        tops[i] = max(tops[i], j)
    assert tops == {
        i: math.ceil(round((min(i * 3 + 1.5 + 1, 30) / 2 + 2) / 3, 6)) - 1 for i in tops
    }


@given(
    st.tuples(coordinates, coordinates, coordinates), st.tuples(lengths, lengths, lengths), sizes
)
def test_a_box_is_covered_from_its_min_corner(
    low: Point,
    extent: Point,
    size: Point,
) -> None:
    high = tuple(a + b for a, b in zip(low, extent, strict=True))
    grid = cut(box(low, high), size)
    counts = [
        max(1, math.ceil((b - a) / s - 1e-6)) for a, b, s in zip(low, high, size, strict=True)
    ]
    assert cells(grid) == set(itertools.product(*(range(n) for n in counts)))
    np.testing.assert_array_equal(grid.origin, low)
    np.testing.assert_array_equal(grid.corners().min(axis=0), low)
    order = grid.indices()[:200]
    for n, cell in enumerate(order[1:], start=1):
        assert any(sum(abs(a - b) for a, b in zip(cell, c, strict=True)) == 1 for c in order[:n])


def test_a_box_of_whole_cells_is_not_rounded_up() -> None:
    assert len(cut(box((0.1, 0.1, 0.1), (0.4, 0.4, 0.4)), (0.1, 0.1, 0.1))) == 27


def test_a_box_is_walked_from_one_end() -> None:
    grid = cut(box((0, 0, 0), (12, 3, 36)), (3, 3, 3))
    assert grid.indices()[:5] == [(1, 0, 0), (1, 0, 1), (0, 0, 0), (2, 0, 0), (1, 0, 2)]


def slope(x: Floats, z: Floats, hint: Floats) -> Floats:
    """A hillside with a hole where x > 20."""
    return np.where(x > 20, np.nan, 0.3 * x + 0.1 * z)


def test_cells_follow_the_ground() -> None:
    size = (4.0, 4.0, 4.0)
    for corridor in (
        path((0, 5, 0), (30, 5, 0), width=6, height=2, follow_ground=True),
        box((0, 5, -8), (30, 9, 8), follow_ground=True, eye_height=1.6),
    ):
        grid = cut(corridor, size, slope)
        x, y, z = grid.centres().T
        ground = slope(x, z, y)
        assert np.isnan(ground).any()
        expected = np.where(np.isnan(ground), 5.0, ground) + corridor.eye_height
        np.testing.assert_allclose(y, expected)
        assert set(grid.index[:, 1]) == {0}


def test_without_ground_the_floor_of_the_path_is_followed() -> None:
    grid = cut(path((0, 0, 0), (40, 8, 0), width=2, height=2, follow_ground=True), (4, 4, 4))
    x, y, _ = grid.centres().T
    np.testing.assert_allclose(y, 0.2 * x + 1.7)


def test_a_path_that_crosses_over_itself_has_two_storeys() -> None:
    corners = [
        (0.0, 0.0, 0.0),
        (40.0, 0.0, 0.0),
        (40.0, 6.0, 20.0),
        (20.0, 6.0, 20.0),
        (20.0, 6.0, -20.0),
    ]
    grid = cut(path(*corners, width=2, height=2, follow_ground=True), (4, 4, 4))
    crossing = [n for n, (i, _, k) in enumerate(grid.indices()) if (i, k) == (5, 0)]
    assert [grid.indices()[n][1] for n in crossing] == [0, 1]
    np.testing.assert_allclose(grid.centres()[crossing, 1], [1.7, 7.7])
    assert sum(1 for _, j, _ in grid.indices() if j == 1) == 1


def test_a_million_cells() -> None:
    began = time.perf_counter()
    assert len(cut(box((0, 0, 0), (1000, 3, 1000)), (1, 3, 1))) == 1_000_000
    assert time.perf_counter() - began < 10


@pytest.mark.parametrize(
    ("document", "complaint"),
    [
        ({}, "either a box or a path"),
        ({"box": None, "path": None}, "either a box or a path"),
        ({"box": {"min": [0, 0, 0], "max": [1, 0, 1]}}, "empty along y"),
        ({"box": {"min": [0, 0, 0], "max": [1, 1, -1]}}, "empty along z"),
        ({"box": {"min": [0, 0], "max": [1, 1, 1]}}, "box.min"),
        ({"box": {"min": [0, 0, 0], "max": [1, 1, 1e300]}}, "box.max.2"),
        ({"box": {"min": [0, 0, math.nan], "max": [1, 1, 1]}}, "box.min.2"),
        ({"path": {"points": [], "width": 1, "height": 1}}, "path.points"),
        ({"path": {"points": [[0, 0, 0]], "width": 0, "height": 1}}, "path.width"),
        ({"path": {"points": [[0, 0, 0]], "width": 1, "height": -1}}, "path.height"),
        ({"path": {"points": [[0, 0, math.inf]], "width": 1, "height": 1}}, "path.points.0.2"),
        ({"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "colour": "red"}, "colour"),
    ],
)
def test_bad_corridors_are_explained(document: dict[str, Any], complaint: str) -> None:
    with pytest.raises(BadInputError, match=complaint) as error:
        parse_corridor(document)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "corridor",
    [
        box((0, 0, 0), (1e6, 1e6, 1e6)),
        path((0, 0, 0), (1e8, 0, 0), width=1, height=1),
        path((0, 0, 0), (1, 0, 0), width=1e6, height=1),
        path((0, 0, 0), (1, 0, 0), width=1000, height=1000),
        path(*[(float(n % 2) * 1e6, 0.0, 0.0) for n in range(1000)], width=1, height=1),
    ],
)
@pytest.mark.parametrize("follow", [False, True])
def test_too_many_cells_are_refused_quickly(corridor: Corridor, follow: bool) -> None:
    if follow and corridor.box is None and corridor.path and corridor.path.width == 1000:
        return  # one cell a column: a million columns are no fault
    began = time.perf_counter()
    with pytest.raises(BadInputError, match="; use larger cells or a smaller corridor"):
        cut(corridor.model_copy(update={"follow_ground": follow}), (1, 1, 1))
    assert time.perf_counter() - began < 10


@pytest.mark.parametrize("size", [(0, 1, 1), (1, -1, 1), (1, 1, math.nan), (1, math.inf, 1)])
def test_bad_cell_sizes_are_refused(size: Point) -> None:
    with pytest.raises(BadInputError):
        cut(box((0, 0, 0), (1, 1, 1)), size)


def test_corridor_files(tmp_path: Path) -> None:
    file = tmp_path / "street.json"
    with pytest.raises(BadInputError, match="cannot be read"):
        read_corridor(file)
    file.write_text("{")
    with pytest.raises(BadInputError, match=r"street\.json: Invalid JSON"):
        read_corridor(file)
    file.write_text(json.dumps({"box": {"min": [0, 0, 0], "max": [1, 2, 3]}}))
    assert read_corridor(file) == box((0, 0, 0), (1, 2, 3))
