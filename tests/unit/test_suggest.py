"""Corridors for models that nobody has made one for: on streets, in rooms, in any unit."""

import itertools

import numpy as np
import pytest
from farfield_core.corridor import cut
from farfield_core.ground import ground_of
from farfield_core.scene import Bounds, PreparedScene
from farfield_core.suggest import guess_scale, suggest_corridor
from numpy.typing import NDArray

from tests.unit.soup import block, soup

Floats = NDArray[np.float64]


def town(unit: float = 1.0, flip: bool = False) -> PreparedScene:
    """Blocks of houses, 30 m apart with streets 12 m wide, on solid ground."""
    parts = [block((-160, -8, -160), (160, 0, 160))]
    for i, k in itertools.product(range(-4, 5), repeat=2):
        if (i, k) != (0, 0):
            parts.append(block((30 * i - 9, 0, 30 * k - 9), (30 * i + 9, 9, 30 * k + 9)))
    corners = np.concatenate(parts) * unit
    return soup(corners[:, ::-1].copy() if flip else corners)


def path_points(scene: PreparedScene) -> tuple[Floats, float]:
    suggestion = suggest_corridor(scene)
    assert suggestion.corridor.path
    return np.array(suggestion.corridor.path.points), suggestion.cell_size


def test_a_street_is_found_not_a_roof_or_a_wall() -> None:
    scene = town()
    points, cell = path_points(scene)
    assert cell == 10.0
    np.testing.assert_allclose(points[:, 1], 0.0, atol=1e-5)
    length = np.linalg.norm(points[-1] - points[0])
    assert 100 < length < 125
    # never inside a house: the way is clear at the height of the eye
    fine = points[0] + np.linspace(0, 1, 500)[:, None] * (points[-1] - points[0])
    inside = np.abs(fine[:, [0, 2]] - 30 * np.round(fine[:, [0, 2]] / 30)).max(axis=1) < 9
    middle = np.abs(fine[:, [0, 2]]).max(axis=1) < 9
    assert not (inside & ~middle).any()


def test_the_suggestion_can_be_cut() -> None:
    scene = town()
    suggestion = suggest_corridor(scene)
    grid = cut(suggestion.corridor, (suggestion.cell_size,) * 3, ground_of(scene))
    assert 10 <= len(grid) <= 40
    np.testing.assert_allclose(grid.centres()[:, 1], 1.7, atol=1e-4)


def test_a_model_wound_the_wrong_way_round() -> None:
    points, _ = path_points(town(flip=True))
    assert points[:, 1].max() - points[:, 1].min() < 1e-4


def test_a_room_in_millimetres() -> None:
    walls = [
        block((0, -200, 0), (6000, 0, 4000)),
        block((0, 2500, 0), (6000, 2700, 4000)),
        block((-200, 0, 0), (0, 2500, 4000)),
        block((6000, 0, 0), (6200, 2500, 4000)),
        block((2500, 0, 1000), (3500, 800, 2000)),  # a table
    ]
    scene = soup(np.concatenate(walls) + np.array([1e5, 0, -3e5]))
    suggestion = suggest_corridor(scene)
    points, cell = path_points(scene)
    np.testing.assert_allclose(points[:, 1], 0.0, atol=0.1)
    assert suggestion.corridor.eye_height == pytest.approx(1700)
    assert 50 < cell < 300


@pytest.mark.parametrize("unit", [0.01, 0.1])
def test_small_models_have_small_walkers(unit: float) -> None:
    points, cell = path_points(town(unit))
    assert cell == pytest.approx(320 * unit * 0.04)
    assert np.linalg.norm(points[-1] - points[0]) > 8 * cell


def test_a_scene_without_a_floor_still_gets_a_walk() -> None:
    wall = np.array([[[0, 0, 0], [0, 10, 0], [0, 0, 30]]], np.float64)
    suggestion = suggest_corridor(soup(wall))
    grid = cut(suggestion.corridor, (suggestion.cell_size,) * 3)
    assert len(grid) >= 1


def test_scales() -> None:
    def scale(x: float, y: float, z: float) -> tuple[float, float]:
        found = guess_scale(Bounds(min=(0.0, 0.0, 0.0), max=(x, y, z)))
        return found.eye, found.cell

    assert scale(900, 74, 785) == (1.7, 10.0)
    assert scale(12750, 84, 15900) == (1.7, 10.0)
    assert scale(6499, 2197, 9995) == pytest.approx((0.7 * 2197, 0.04 * 6499))
    assert scale(1472, 448, 832) == (1.7, 10.0)
    assert scale(1, 1, 1) == pytest.approx((0.7, 0.04))
    assert all(n > 0 for n in scale(0, 0, 0))
