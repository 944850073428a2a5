"""Which triangles the near field of a cell lists."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from farfield_core.scene import PreparedScene
from farfield_worker.near import near_list, near_triangles
from farfield_worker.near.select import cube_meets, runs
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.prepare.build import Gltf, prepared, soup


def slow_meets(triangle: np.ndarray, half_width: float) -> bool:
    """Clip the triangle by the cube's six planes, one after another; is anything left?"""
    polygon = [np.asarray(p, np.float64) for p in triangle]
    for axis in range(3):
        for side in (-1.0, 1.0):
            room = [half_width - side * p[axis] for p in polygon]
            kept: list[np.ndarray] = []
            for k, p in enumerate(polygon):
                n = (k + 1) % len(polygon)
                if room[k] >= 0:
                    kept.append(p)
                if (room[k] >= 0) != (room[n] >= 0):
                    share = room[k] / (room[k] - room[n])
                    kept.append(p + share * (polygon[n] - p))
            polygon = kept
            if not polygon:
                return False
    return True


numbers = st.floats(-3, 3, width=32)


@settings(max_examples=500)
@given(st.lists(numbers, min_size=9, max_size=9), st.floats(0.1, 2))
def test_overlap_like_clipping(values, half_width):
    triangle = np.array(values, np.float32).reshape(3, 3)
    inner, outer = slow_meets(triangle, half_width - 1e-6), slow_meets(triangle, half_width + 1e-6)
    corners = np.array([[0, 1, 2]], np.uint32)
    (found,) = cube_meets(triangle, corners, np.zeros(3), half_width)
    # where a hair decides, either answer will do
    assert found in (inner, outer)


def test_overlap_of_a_triangle_around_the_cube():
    big = np.array([[-100, 0, -100], [100, 0, -100], [0, 0, 200]], np.float32)
    corners = np.array([[0, 1, 2]], np.uint32)
    for height, expected in ((0.0, True), (0.99, True), (1.01, False)):
        moved = big + np.float32([0, height, 0])
        assert cube_meets(moved, corners, np.zeros(3), 1.0).tolist() == [expected]
        assert slow_meets(moved, 1.0) == expected


@given(st.lists(st.booleans(), max_size=60))
def test_runs(chosen):
    found = runs(np.array(chosen, np.bool_))
    listed = [False] * len(chosen)
    for first, count in found:
        assert count > 0
        listed[first : first + count] = [True] * count
    assert listed == chosen
    for (first, count), (following, _) in pairwise(found):
        assert first + count < following


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> PreparedScene:
    """A cloud of small triangles with a large one through it, in two batches."""
    random = np.random.default_rng(5)
    gltf = Gltf()
    gltf.add("materials", {})
    gltf.add("materials", {"doubleSided": True})
    for material in range(2):
        centre = random.uniform(-20, 20, (6000, 1, 3))
        small = (centre + random.normal(0, 0.4, (6000, 3, 3))).astype("f4").reshape(-1, 3)
        primitive = {"attributes": {"POSITION": gltf.accessor(small)}, "material": material}
        gltf.node(mesh=gltf.mesh(primitive), translation=[1000, 0, 0])
    large = np.array([[-60, 1, -60], [60, 1, -60], [0, 2, 90]], "f4")
    gltf.node(
        mesh=gltf.mesh({"attributes": {"POSITION": gltf.accessor(large)}, "material": 0}),
        translation=[1000, 0, 0],
    )
    return prepared(gltf, tmp_path_factory.mktemp("near"))


@pytest.mark.parametrize(
    ("eye", "half_width"),
    [
        ((1000, 0, 0), 5.0),
        ((1010, 3, -7), 2.5),
        ((1000, 1.4, 0), 0.01),
        ((1000, 0, 0), 500.0),
        ((1019, 19, 19), 8.0),
    ],
)
def test_near_list_is_complete_and_tight(scene, eye, half_width):
    triangles = soup(scene).positions - eye
    expected = np.array([slow_meets(t, half_width) for t in triangles])
    listed = np.zeros(len(triangles), np.bool_)
    total = 0
    for entry in near_list(scene, near_triangles(scene, np.array(eye, np.float64), half_width)):
        block = scene.info.blocks[entry.block]
        total += entry.triangles
        rows = np.array(entry.ranges).reshape(-1, 3)
        assert (np.diff(rows[:, 0]) >= 0).all()
        for primitive, first, count in rows.tolist():
            part = block.parts[primitive]
            assert first >= 0
            assert first + count <= part.triangles
            start = part.first_triangle + first
            assert not listed[start : start + count].any()
            listed[start : start + count] = True
    assert not (expected & ~listed).any()
    assert total == listed.sum()
    assert expected.sum() > 0
    # where a hair decides, either answer will do
    assert (listed & ~expected).sum() <= 2


def test_only_some_are_listed(scene):
    inside = near_triangles(scene, np.array([1000.0, 0, 0]), 5.0)
    some = inside[np.random.default_rng(2).random(len(inside)) < 0.3]
    listed = []
    for entry in near_list(scene, some):
        block = scene.info.blocks[entry.block]
        for primitive, first, count in np.array(entry.ranges).reshape(-1, 3).tolist():
            start = block.parts[primitive].first_triangle + first
            listed += range(start, start + count)
    assert listed == some.tolist()


def test_nothing_near(scene):
    assert near_list(scene, near_triangles(scene, np.array([1000.0, 500, 0]), 10.0)) == []
