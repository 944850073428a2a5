"""Packing: everything lies on its page with a gutter around, and nothing meets."""

import numpy as np
from farfield_worker.compile.pack import GUTTER, pack
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import SEEDS


def check(width, height, page_width, page_height, places):
    """Stamp every rectangle with its gutter on pages that were empty; returns their number."""
    assert all(column.dtype == np.int32 for column in places)
    pages = int(places.page.max(initial=-1)) + 1
    taken = np.zeros((pages, page_height, page_width), bool)
    for w, h, page, x, y in zip(width, height, *places, strict=True):
        assert page >= 0
        assert x >= GUTTER
        assert x + w + GUTTER <= page_width
        assert y >= GUTTER
        assert y + h + GUTTER <= page_height
        spot = taken[page, y - GUTTER : y + h + GUTTER, x - GUTTER : x + w + GUTTER]
        assert not spot.any()
        spot[:] = True
    assert taken.any(axis=(1, 2)).all()
    return pages


@given(
    seed=SEEDS,
    n=st.integers(0, 80),
    page=st.tuples(st.integers(3, 40), st.integers(3, 40)),
    share=st.sampled_from([0.2, 0.5, 1.0]),
)
@settings(max_examples=300)
def test_pack(seed, n, page, share):
    rng = np.random.default_rng(seed)
    page_width, page_height = page
    width = rng.integers(1, max(int((page_width - 2 * GUTTER) * share), 1) + 1, n, np.int32)
    height = rng.integers(1, max(int((page_height - 2 * GUTTER) * share), 1) + 1, n, np.int32)
    places = pack(width, height, page_width, page_height)
    check(width, height, page_width, page_height, places)


def test_several_pages_are_filled_one_after_the_other():
    width = height = np.full(9, 8, np.int32)
    places = pack(width, height, 20, 20)
    assert check(width, height, 20, 20, places) == 3
    assert places.page.tolist() == [0, 0, 0, 0, 1, 1, 1, 1, 2]


def test_pages_are_used_well():
    """Rectangles like those of a bake take little more than their area with gutters."""
    rng = np.random.default_rng(1)
    width, height = np.ceil(rng.pareto(1.2, (2, 4000)) + 1).clip(1, 200).astype(np.int32)
    places = pack(width, height, 512, 512)
    pages = check(width, height, 512, 512, places)
    last = (places.y + height + 1)[places.page == pages - 1].max()
    used = ((pages - 1) * 512 + last) * 512
    assert ((width + 2) * (height + 2)).sum() > 0.9 * used


def test_no_rectangles():
    none = np.empty(0, np.int32)
    assert [len(column) for column in pack(none, none, 64, 64)] == [0, 0, 0]
