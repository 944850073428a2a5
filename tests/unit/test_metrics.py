"""The figures against loops over pixels, and on pictures whose answer is known."""

import numpy as np
import pytest
from farfield_worker.verify.metrics import (
    MATCH,
    Figures,
    Shot,
    combine,
    compare,
    eroded,
    flip_map,
    mean_flip,
    unmatched,
)
from hypothesis import given
from hypothesis import strategies as st

seeds = st.integers(0, 2**32 - 1)


def neighbours(h: int, w: int, y: int, x: int):
    for v in range(max(0, y - 1), min(h, y + 2)):
        for u in range(max(0, x - 1), min(w, x + 2)):
            yield v, u


def random_shot(rng: np.random.Generator, h: int, w: int) -> Shot:
    geometry = rng.random((h, w)) < 0.7
    levels = np.array([0, 7, 15, 200], np.uint8)
    return Shot(rng.choice(levels, (h, w, 3)), geometry, geometry & (rng.random((h, w)) < 0.6))


@given(seeds, st.integers(1, 7), st.integers(1, 7))
def test_against_loops(seed: int, h: int, w: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = random_shot(rng, h, w), random_shot(rng, h, w)
    wrong_ab = wrong_ba = missing = extra = pixels = 0
    for y in range(h):
        for x in range(w):
            near = list(neighbours(h, w, y, x))

            def same(p, q, y=y, x=x, near=near):
                return any(
                    all(abs(int(c) - int(d)) <= MATCH for c, d in zip(p[y, x], q[n], strict=True))
                    for n in near
                )

            assert unmatched(a.rgb, b.rgb)[y, x] == (not same(a.rgb, b.rgb))
            assert eroded(a.geometry)[y, x] == all(a.geometry[n] for n in near)
            if not (a.far[y, x] or b.far[y, x]):
                continue
            pixels += 1
            wrong_ab += not same(a.rgb, b.rgb)
            wrong_ba += not same(b.rgb, a.rgb)
            missing += not b.geometry[y, x] and all(a.geometry[n] for n in near)
            extra += not a.geometry[y, x] and all(b.geometry[n] for n in near)
    figures = compare(a, b)
    if pixels == 0:
        assert figures is None
        return
    assert figures is not None
    assert figures.pixels == pixels
    assert figures.wrong * pixels == pytest.approx(max(wrong_ab, wrong_ba))
    assert figures.missing * pixels == pytest.approx(missing)
    assert figures.extra * pixels == pytest.approx(extra)


def test_a_picture_equals_itself() -> None:
    shot = random_shot(np.random.default_rng(3), 32, 32)
    figures = compare(shot, shot)
    assert figures is not None
    assert figures[:4] == (0, 0, 0, 0)
    assert figures.psnr == np.inf


def test_flip_sees_a_difference_where_it_is() -> None:
    a = np.full((64, 64, 3), 128, np.uint8)
    b = a.copy()
    b[20:30, 40:50] = (255, 0, 0)
    error = flip_map(a, b)
    assert error[20:30, 40:50].mean() > 0.3
    assert error[:, :16].max() < 1e-3


def test_mean_flip_is_the_mean_of_the_map() -> None:
    """The rectangle it looks at leaves out nothing that matters."""
    rng = np.random.default_rng(11)
    a, b = (rng.integers(0, 256, (96, 128, 3), np.uint8) for _ in range(2))
    for y, x, h, w in ((40, 50, 7, 9), (0, 0, 1, 1), (90, 3, 6, 80), (0, 0, 96, 128)):
        mask = np.zeros((96, 128), bool)
        mask[y : y + h, x : x + w] = rng.random((h, w)) < 0.9
        mask[y, x] = True
        assert mean_flip(a, b, mask) == pytest.approx(flip_map(a, b)[mask].mean(), abs=1e-6)


def test_combine_is_the_figure_of_the_joined_picture() -> None:
    rng = np.random.default_rng(5)
    pairs = [(random_shot(rng, 24, 16), random_shot(rng, 24, 16)) for _ in range(3)]
    parts = [compare(a, b) for a, b in pairs]
    total = combine([p for p in parts if p is not None])
    assert total is not None
    error = np.concatenate(
        [(a.rgb[f].astype(float) - b.rgb[f]) for a, b in pairs for f in [a.far | b.far]]
    )
    assert total.psnr == pytest.approx(10 * np.log10(255**2 / (error**2).mean()))
    assert total.pixels == sum(p.pixels for p in parts if p is not None)
    assert combine([]) is None
    assert combine([Figures(0.5, 0, 0, 0, 20, 10)] * 2).wrong == 0.5
