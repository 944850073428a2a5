"""Colours under transparent texels and in gutters, against loops."""

import numpy as np
from farfield_worker.compile.dilate import dilate
from farfield_worker.compile.pack import pack
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.layered_faces import SEEDS

OPAQUE = 0xFF000000


def continued(tile):
    """What a rectangle (h, w) uint32 looks like inside, and with its gutter around."""
    covered = tile >= OPAQUE
    out = tile.copy()
    height, width = tile.shape
    columns = [c for c in range(width) if covered[:, c].any()]
    for c in columns:
        rows = [r for r in range(height) if covered[r, c]]
        for r in range(height):
            if not covered[r, c]:
                above = [row for row in rows if row < r]
                out[r, c] = tile[above[-1] if above else rows[0], c] - OPAQUE
    for c in range(width):
        if c not in columns:
            left = [column for column in columns if column < c]
            source = left[-1] if left else columns[0]
            out[:, c] = [color % (1 << 24) for color in out[:, source]]
    return out, np.pad(out, 1, mode="edge")


@given(seed=SEEDS, n=st.integers(0, 6))
def test_dilate(seed, n):
    rng = np.random.default_rng(seed)
    width, height = rng.integers(1, 9, (2, n)).astype(np.int32)
    places = pack(width, height, 16, 14)
    pages = np.zeros((int(places.page.max(initial=-1)) + 1, 14, 16), np.uint32)
    expected = pages.copy()
    for w, h, page, x, y in zip(width, height, *places, strict=True):
        tile = rng.integers(0, 1 << 24, (h, w), np.uint32)
        tile = np.where(rng.random((h, w)) < rng.choice([0.1, 0.6, 1.0]), tile + OPAQUE, 0)
        tile[rng.integers(h), rng.integers(w)] = OPAQUE + rng.integers(1 << 24)
        pages[page, y : y + h, x : x + w] = tile
        inside, around = continued(tile.astype(np.uint32))
        expected[page, y - 1 : y + h + 1, x - 1 : x + w + 1] = around
        covered = tile >= OPAQUE
        np.testing.assert_array_equal(inside[covered], tile[covered])
        assert (inside[~covered] < OPAQUE).all()
    dilate(pages, *places, width, height)
    np.testing.assert_array_equal(pages, expected)
