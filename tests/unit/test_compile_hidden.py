"""Hidden texels against eyes: what is taken away must not be seen from anywhere in the cell."""

import numpy as np
import pytest
from farfield_core import placement
from farfield_worker.compile.hidden import hidden, reaches, shift
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import RESOLUTIONS, SEEDS, packed, random_planes, unpacked

HALVES = st.tuples(*[st.sampled_from([0.5, 1.0, 1.7])] * 3)


def all_of(plane, row, column, across, down):
    """Whether the whole neighbourhood lies in the face and in `plane`."""
    size = len(plane)
    if row < down or column < across or row + down >= size or column + across >= size:
        return False
    return plane[row - down : row + down + 1, column - across : column + across + 1].all()


@given(
    seed=SEEDS,
    resolution=RESOLUTIONS,
    reach=st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), max_size=4),
)
@settings(max_examples=50)
def test_hidden_against_the_recursion(seed, resolution, reach):
    planes = random_planes(seed, len(reach) + 1, resolution)
    expected = np.zeros_like(planes)
    for i in range(len(reach) - 1, -1, -1):
        blocking = planes[i + 1] | expected[i + 1]
        for row in range(resolution):
            for column in range(resolution):
                expected[i, row, column] = all_of(blocking, row, column, *reach[i])
    np.testing.assert_array_equal(unpacked(hidden(packed(planes), reach)), expected)


def seen_from(eye, planes, layers, points, on):
    """Whether the points (n, 2) of layer `on` are seen from `eye`: nothing nearer is in the way.

    `eye` and layers are in face coordinates (right, down, forward); texel grids are looked up with
    both texels at an edge, as either may be drawn there.
    """
    resolution = planes.shape[1]
    far = np.concatenate([points * layers[on], np.full((len(points), 1), layers[on])], axis=1)
    seen = np.ones(len(points), bool)
    for nearer in range(on + 1, len(layers)):
        share = (layers[nearer] - eye[2]) / (layers[on] - eye[2])
        u = (eye[:2] + (far[:, :2] - eye[:2]) * share) / layers[nearer]
        x = (u + 1) * resolution / 2
        blocked = np.ones(len(points), bool)
        for nudge in (-1e-7, 1e-7):
            column, row = np.floor(x + nudge).astype(int).T
            inside = (column >= 0) & (column < resolution) & (row >= 0) & (row < resolution)
            blocked &= inside
            blocked[inside] &= planes[nearer, row[inside], column[inside]]
        seen &= ~blocked
    return seen


@given(seed=SEEDS, resolution=st.integers(8, 70), half=HALVES, gap=st.sampled_from([1.0, 2.0]))
@settings(max_examples=60)
def test_no_eye_sees_a_hidden_texel(seed, resolution, half, gap):
    """The centre of LEMI's argument, by rays: eyes all over the cell, texels' corners too."""
    rng = np.random.default_rng(seed)
    layers = np.array(placement.place(half, resolution, 5, None, gap).layers)
    planes = random_planes(seed, len(layers), resolution)
    gone = unpacked(hidden(packed(planes), reaches(layers, half, resolution)))
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    eyes = np.concatenate([corners, rng.uniform(-1, 1, (8, 3))]) * half
    for on in range(len(layers)):
        row, column = np.nonzero(gone[on])
        for eye in eyes:
            inside = rng.choice([0.0, 0.5, 1.0], (len(row), 2)) * (1 - 2e-6) + 1e-6
            points = (np.stack([column, row], axis=1) + inside) * 2 / resolution - 1
            assert not seen_from(eye, planes, layers, points, on).any()


@given(half=HALVES, far=st.floats(3, 1e4), ratio=st.floats(0.3, 0.99), seed=SEEDS)
def test_shift_bounds_every_eye_and_is_reached(half, far, ratio, seed):
    near = max(far * ratio, 2.0)
    across, down = shift(far, near, half, 64)
    rng = np.random.default_rng(seed)
    corners = [(x, y, z, u) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1) for u in (-1, 1)]
    cases = np.concatenate([corners, rng.uniform(-1, 1, (200, 4))])
    moved = []
    for axis, bound in ((0, across), (1, down)):
        e, ez, u = cases[:, axis] * half[axis], cases[:, 2] * half[2], cases[:, 3]
        at_near = e + (u * far - e) * (near - ez) / (far - ez)
        moved.append(np.abs(at_near / near - u) * 32)
        assert moved[-1].max() <= bound * (1 + 1e-9) + 1e-9
        assert moved[-1].max() == pytest.approx(bound)


def test_layers_placed_by_the_paper_shift_by_one_texel():
    layers = placement.place((7, 7, 7), 512, 64).layers
    assert set(reaches(layers, (7, 7, 7), 512)) == {(1, 1)}
    wider = placement.place((7, 7, 7), 512, 20, None, 2.0).layers
    assert set(reaches(wider, (7, 7, 7), 512)) <= {(1, 1), (2, 2)}
    assert reaches([100.0], (1, 1, 1), 512) == []


def test_a_whole_wall_hides_all_but_the_border_behind_it():
    planes = np.zeros((3, 66, 66), bool)
    planes[2] = True
    gone = unpacked(hidden(packed(planes), [(1, 1), (1, 1)]))
    assert not gone[2].any()
    assert gone[1, 1:-1, 1:-1].all()
    assert gone[1].sum() == 64 * 64
    assert gone[0].sum() == 62 * 62
