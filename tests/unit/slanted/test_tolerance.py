"""The tolerance on disparity against angles measured by brute force over the cell."""

import math

import numpy as np
import pytest
from farfield_core.errors import BadInputError
from farfield_core.faces import directions
from farfield_core.placement import FaceMetric
from farfield_worker.slanted.tolerance import Tolerance
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

Floats = NDArray[np.float64]
unit = st.floats(-1, 1)


def worst_angle(eye: Floats, half: Floats, w: Floats, d: float, drawn: float, steps: int) -> float:
    """Largest angle at which any of a lattice of eyes sees eye + w / d and eye + w / drawn part."""
    axes = [np.linspace(-h, h, steps) for h in half]
    eyes = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    p, q = eye + w / d - eyes, eye + w / drawn - eyes
    across = np.linalg.norm(np.cross(p, q), axis=1)
    return float(np.arctan2(across, np.einsum("ij,ij->i", p, q)).max())


@given(
    st.integers(0, 5),
    st.tuples(unit, unit, unit),
    st.tuples(st.floats(0.5, 8), st.floats(0.5, 8), st.floats(0.5, 8)),
    st.tuples(unit, unit),
    st.floats(1.05, 20),
    st.floats(0.0, 1.0),
    st.sampled_from([0.3, 1e-2, 1e-3]),
)
def test_no_eye_sees_more_than_alpha(
    face: int,
    place: tuple[float, float, float],
    half_extents: tuple[float, float, float],
    uv: tuple[float, float],
    near: float,
    far: float,
    alpha: float,
) -> None:
    half = np.array(half_extents)
    near = near * float(half.max())
    eye = np.array(place) * half
    w = directions(face, np.array(uv[0]), np.array(uv[1]))
    # the surface lies on the near cube or further out, up to infinitely far
    walls = (near - np.sign(w) * eye) / np.maximum(np.abs(w), 1e-12)
    d = (1 - far) / float(walls.min()) + far * 1e-9
    tolerance = Tolerance.of(face, eye, half_extents, alpha, near, factor=1.0)
    low, high = tolerance.interval(np.array(d))
    assert low < d < high
    # the drawn point never lies inside the near cube: slanted/near_border.py sees to it
    for drawn in (max(float(low), 1e-12), min(float(high), 1 / float(walls.min()))):
        assert worst_angle(eye, half, w, d, drawn, 3) <= alpha * (1 + 1e-9) + 1e-12


def test_the_bound_is_reached() -> None:
    half, alpha = np.array([5.0, 5.0, 5.0]), 1e-3
    tolerance = Tolerance.of(4, np.zeros(3), half, alpha, 40.0, factor=1.0)
    high = tolerance.interval(np.array(1 / 60))[1]
    rng = np.random.default_rng(1)
    worst = max(
        worst_angle(np.zeros(3), half, directions(4, u, v), 1 / 60, float(high), 2)
        for u, v in rng.uniform(-1, 1, (2000, 2))
    )
    assert 0.99 * alpha < worst <= alpha


@given(st.floats(1, 10), st.floats(1, 10), st.floats(1, 10), st.floats(1.1, 50))
def test_the_centre_has_the_papers_metric(h: float, a: float, b: float, near: float) -> None:
    near *= max(h, a, b)
    metric = FaceMetric.of(h, a, b, 2e-3, 512, None)
    tolerance = Tolerance.of(0, np.zeros(3), (h, a, b), 2e-3, near, factor=0.5)
    y = 1.5 * near
    low, high = tolerance.interval(np.array(1 / y))
    step = 0.5 * metric.ln_k
    if metric.ln_k * (1 - h / y) / h >= 2e-3 * (near - max(h, a, b)) / math.hypot(h, a, b) / y:
        assert metric.ln_g(1 / high) - metric.ln_g(y) == pytest.approx(step, rel=1e-6)
        if low > 0:
            assert metric.ln_g(y) - metric.ln_g(1 / low) == pytest.approx(step, rel=1e-6)
        # the simpler form is the stricter one
        simple = step * (1 - h * high) / h
        assert simple <= high - 1 / y


@given(st.tuples(unit, unit, unit), st.lists(st.floats(0, 1), min_size=2, max_size=30))
def test_ends_rise_with_disparity(place: tuple[float, float, float], shares: list[float]) -> None:
    half = np.array([5.0, 3.0, 4.0])
    tolerance = Tolerance.of(2, np.array(place) * half, half, 0.05, 8.0)
    d = np.sort(np.array(shares)) / 3.0
    low, high = tolerance.interval(d)
    assert np.all(np.diff(low) >= -1e-15)
    assert np.all(np.diff(high) >= -1e-15)


def test_refusals() -> None:
    with pytest.raises(BadInputError, match="near field"):
        Tolerance.of(0, np.zeros(3), (5, 5, 5), 1e-3, 5.0)
    with pytest.raises(BadInputError, match="tolerance"):
        Tolerance.of(0, np.zeros(3), (5, 5, 5), 1e-3, 20.0, factor=0.0)
    with pytest.raises(BadInputError, match="eye"):
        Tolerance.of(0, np.array([6.0, 0, 0]), (5, 5, 5), 1e-3, 20.0)
