"""The ground under a walker: against lines cast at one triangle after the other."""

import numpy as np
import pytest
from farfield_core.ground import ground_of, surfaces
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.soup import block, floor, soup

Floats = NDArray[np.float64]


def hits_one_by_one(corners: Floats, x: float, z: float) -> list[tuple[float, float]]:
    """(y, cosine of the slope) of every triangle over or under (x, z); Moeller-Trumbore upwards."""
    found = []
    up = np.array([0.0, 1.0, 0.0])
    start = np.array([x, -1000.0, z])
    for a, b, c in corners:
        p = np.cross(up, c - a)
        det = (b - a) @ p
        if abs(det) < 1e-12:
            continue
        u = (start - a) @ p / det
        q = np.cross(start - a, b - a)
        v = up @ q / det
        if u >= 0 and v >= 0 and u + v <= 1:
            normal = np.cross(b - a, c - a)
            found.append(((c - a) @ q / det - 1000, normal[1] / np.linalg.norm(normal)))
    return sorted(found)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_lines_meet_every_surface(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    # single precision, as scenes are kept
    corners = random.uniform(-10, 10, (count, 3, 3)).astype(np.float32).astype(np.float64)
    x, z = random.uniform(-11, 11, (2, 30))
    hits = surfaces(soup(corners), x, z)
    for n in range(30):
        expected = hits_one_by_one(corners, x[n], z[n])
        mine = hits.line == n
        np.testing.assert_allclose(hits.y[mine], [y for y, _ in expected], atol=1e-6)
        np.testing.assert_allclose(hits.up[mine], [up for _, up in expected], atol=1e-6)
    assert (np.diff(hits.line) >= 0).all()


@given(st.integers(0, 2**32 - 1))
def test_the_walkable_surface_nearest_to_the_hint_is_taken(seed: int) -> None:
    random = np.random.default_rng(seed)
    corners = random.uniform(-10, 10, (30, 3, 3)).astype(np.float32).astype(np.float64)
    x, z = random.uniform(-11, 11, (2, 30))
    hint = random.uniform(-12, 12, 30)
    heights = ground_of(soup(corners))(x, z, hint)
    for n in range(30):
        flat = [y for y, up in hits_one_by_one(corners, x[n], z[n]) if abs(up) > 0.5]
        if flat:
            nearest = min(flat, key=lambda y: abs(y - hint[n]))
            assert heights[n] == pytest.approx(nearest, abs=1e-6)
        else:
            assert np.isnan(heights[n])


def test_two_storeys_and_no_ground() -> None:
    house = np.concatenate([floor((0, 0), (10, 10), 0), floor((0, 0), (5, 10), 3)])
    ground = ground_of(soup(house))
    x, z = np.array([2.0, 2.0, 7.0, 12.0]), np.full(4, 5.0)
    np.testing.assert_allclose(ground(x, z, np.array([0.4, 2.6, 2.6, 0.0])), [0, 3, 0, np.nan])


def test_walls_are_no_ground() -> None:
    steep = np.array([[[0, 0, 0], [0, 0, 10], [1, 10, 0]]], np.float64)
    heights = ground_of(soup(steep))(np.array([0.2]), np.array([1.0]), np.array([0.0]))
    assert np.isnan(heights[0])


def test_far_from_the_origin() -> None:
    origin = (7.0e6, -2.0e6, 3.0e6)
    here = block((-2, 0, -2), (2, 1.25, 2))
    ground = ground_of(soup(here + np.array(origin), origin))
    heights = ground(np.array([origin[0]]), np.array([origin[2]]), np.array([origin[1] + 1.0]))
    assert heights[0] == origin[1] + 1.25


def test_many_lines_over_many_triangles_go_in_batches() -> None:
    side = np.linspace(-50, 50, 41)
    tiles = [floor((a, b), (a + 2.5, b + 2.5), 0.1 * a) for a in side[:-1] for b in side[:-1]]
    random = np.random.default_rng(0)
    x, z = random.uniform(-49, 49, (2, 100_000))
    heights = ground_of(soup(np.concatenate(tiles)))(x, z, np.zeros(100_000))
    np.testing.assert_allclose(heights, 0.1 * (np.floor((x + 50) / 2.5) * 2.5 - 50), atol=1e-5)


def test_no_lines() -> None:
    none = np.zeros(0)
    assert len(ground_of(soup(floor((0, 0), (1, 1), 0)))(none, none, none)) == 0
