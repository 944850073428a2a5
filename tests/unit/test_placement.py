"""Placement against the paper's literal loop, its published numbers, and brute force."""

import math

import numpy as np
import pytest
from farfield_core.errors import BadInputError
from farfield_core.placement import (
    Placement,
    default_alpha,
    layers_across,
    layers_for_near,
    metrics,
    place,
)
from hypothesis import assume, given
from hypothesis import strategies as st


def paper_loop(m: float, resolution: int, count: int, alpha: float) -> Placement:
    """Equations (1) and (2) as iterated by the paper for a cube of half size m."""
    phi = math.pi / 4 - math.atan(math.sqrt(2)) / 2
    k = math.exp(4 * math.atanh(math.tan(phi) * math.tan(alpha / 2)))

    def g(y: float) -> float:
        return 1.0 if math.isinf(y) else y / (y - m)

    def inverse(value: float) -> float:
        return m * value / (value - 1)

    def texel(y: float) -> float:
        return inverse(g(y) / (1 - 1 / resolution))

    layers = [inverse(g(math.inf) * k)]
    borders = []
    for _ in range(count - 1):
        parallax_layer = inverse(g(inverse(g(layers[-1]) * k)) * k)
        nearer = max(parallax_layer, texel(layers[-1]))
        borders.append(inverse(math.sqrt(g(layers[-1]) * g(nearer))))
        layers.append(nearer)
    borders.append(inverse(g(layers[-1]) * k))
    return Placement(tuple(layers), tuple(borders))


@pytest.mark.parametrize(
    ("size", "layers", "near_width"), [(14.0, 64, 118.2277), (10.0, 64, 84.4484), (10.0, 1, 3492.7)]
)
def test_published_numbers(size: float, layers: int, near_width: float) -> None:
    placement = place((size / 2,) * 3, 512, layers)
    assert 2 * placement.near_field == pytest.approx(near_width, rel=1e-5)


def test_issue_number() -> None:
    assert round(place((7, 7, 7), 512, 64).near_field, 2) == 59.11


@given(st.floats(0.5, 50), st.sampled_from([128, 256, 512, 1000, 2048]), st.integers(1, 200))
def test_equals_the_literal_loop(m: float, resolution: int, layers: int) -> None:
    alpha = default_alpha(resolution)
    ours = place((m, m, m), resolution, layers)
    literal = paper_loop(m, resolution, layers, alpha)
    np.testing.assert_allclose(ours.layers, literal.layers, rtol=1e-9)
    np.testing.assert_allclose(ours.borders, literal.borders, rtol=1e-9)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.arctan2(cross, (a * b).sum(-1))


extents = st.tuples(st.floats(0.5, 8), st.floats(0.5, 8), st.floats(0.5, 8))


@given(
    extents,
    st.sampled_from([64, 256, 512]),
    st.integers(1, 40),
    st.sampled_from([0.5, 1.0, 3.0, None]),
    st.integers(0, 2**32 - 1),
)
def test_no_eye_in_the_cell_exceeds_the_parallax_bound(
    half: tuple[float, float, float],
    resolution: int,
    layers: int,
    gap: float | None,
    seed: int,
) -> None:
    """Points of the far field, moved along the centre's ray onto their layer, from random eyes."""
    alpha = default_alpha(resolution)
    placement = place(half, resolution, layers, alpha, gap)
    rng = np.random.default_rng(seed)
    borders = np.array([1e12, *placement.borders])
    h = np.array(half)
    for axis in range(3):
        n = 400
        layer = rng.integers(0, layers, n)
        # ends of the layer's range are where the bound is tight
        end = rng.integers(0, 2, n)
        z = np.where(end == 0, borders[layer], borders[layer + 1])
        uv = np.where(
            rng.random((n, 2)) < 0.5, rng.choice([-1.0, 1.0], (n, 2)), rng.uniform(-1, 1, (n, 2))
        )
        direction = np.insert(uv, axis, 1.0, axis=1)
        eye = h * np.where(
            rng.random((n, 3)) < 0.8, rng.choice([-1.0, 1.0], (n, 3)), rng.uniform(-1, 1, (n, 3))
        )
        true = direction * z[:, None] - eye
        drawn = direction * np.array(placement.layers)[layer][:, None] - eye
        assert angle(true, drawn).max() <= alpha * (1 + 1e-6)


def test_the_bound_is_reached_at_a_corner_of_a_cube() -> None:
    """The placement wastes nothing: some corner sees exactly alpha."""
    m, resolution = 7.0, 512
    alpha = default_alpha(resolution)
    placement = place((m, m, m), resolution, 8, alpha, None)
    t = np.linspace(-1, 1, 801)
    u, v = np.meshgrid(t, t)
    direction = np.stack([u, v, np.ones_like(u)], -1)
    worst = 0.0
    for corner in np.array(np.meshgrid([-m, m], [-m, m], [-m, m])).reshape(3, -1).T:
        true = direction * placement.borders[3] - corner
        drawn = direction * placement.layers[4] - corner
        worst = max(worst, float(angle(true, drawn).max()))
    assert worst == pytest.approx(alpha, rel=1e-3)


@given(st.floats(1, 20), st.sampled_from([128, 512]), st.integers(2, 80), st.floats(0.25, 4))
def test_neighbouring_layers_shift_by_at_most_the_gap_bound(
    m: float, resolution: int, layers: int, gap: float
) -> None:
    """The shift between layers i and i + 1 seen by an eye m off centre, in texels of the nearer."""
    ys = np.array(place((m, m, m), resolution, layers, gap_texels=gap).layers)
    # the eye at lateral m and height m: a point of the far layer appears on the near one moved by
    shift = m * (ys[:-1] - ys[1:]) / (ys[:-1] - m)
    texel = 2 * ys[1:] / resolution
    assert (shift / texel).max() <= gap * (1 + 1e-9)


@given(extents, st.sampled_from([128, 512]), st.integers(1, 64), st.sampled_from([1.0, None]))
def test_order(
    half: tuple[float, float, float], resolution: int, layers: int, gap: float | None
) -> None:
    p = place(half, resolution, layers, gap_texels=gap)
    interleaved = np.array([x for pair in zip(p.layers, p.borders, strict=True) for x in pair])
    assert (np.diff(interleaved) < 0).all()
    assert p.near_field > max(half)
    assert len(p.layers) == len(p.borders) == layers


@given(st.floats(0.5, 8), extents)
def test_a_box_needs_no_more_than_its_bounding_cube(
    scale: float, half: tuple[float, float, float]
) -> None:
    box = place(half, 256, 16)
    cube = place((max(half),) * 3, 256, 16)
    assert box.near_field <= cube.near_field * (1 + 1e-9)


@given(st.floats(1, 10), st.floats(1.5, 100))
def test_layers_for_near_is_the_smallest(m: float, factor: float) -> None:
    near = m * factor
    count = layers_for_near(near, (m, m, m), 128)
    assume(count < 4000)
    assert place((m, m, m), 128, count).near_field <= near
    if count > 1:
        assert place((m, m, m), 128, count - 1).near_field > near


@given(st.floats(1, 10), st.floats(1.5, 100))
def test_layers_across_is_as_many_in_closed_form(m: float, factor: float) -> None:
    near = m * factor
    count = layers_for_near(near, (m, m, m), 128)
    across = layers_across(near, (m, m, m), 128)
    assert count - 1 - 1e-6 <= across <= count + 1e-6


@pytest.mark.parametrize(
    "call",
    [
        lambda: layers_for_near(1.0001, (1, 1, 1), 512),
        lambda: place((1, 1, 1), 512, 0),
        lambda: place((1, 1, 0), 512, 4),
        lambda: place((1, math.nan, 1), 512, 4),
        lambda: place((1, 1, 1), 1, 4),
        lambda: place((1, 1, 1), 512, 4, alpha=1.0),
        lambda: place((1, 1, 1), 512, 4, gap_texels=0.0),
        lambda: metrics((1, 1, 1), 0.01, 512, 1.0, ()),
        lambda: layers_for_near(0.9, (1, 1, 1), 512),
    ],
)
def test_refusals_are_sentences(call) -> None:
    with pytest.raises(BadInputError, match=r"^[A-Z].*\.$"):
        call()
