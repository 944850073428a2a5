"""Atlas files, decoded by Pillow, bit for bit, and PNG's filters as the standard has them."""

import io

import numpy as np
import pytest
from farfield_worker.compile.encode import ENCODERS
from farfield_worker.compile.filters import filtered
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.unit.layered_faces import SEEDS

PILLOW = {"png": "PNG", "webp": "WEBP"}


def decoded(data, kind):
    with Image.open(io.BytesIO(data)) as image:
        assert image.format == PILLOW[kind]
        # WebP says RGB where all is opaque
        return np.asarray(image.convert("RGBA"))


@pytest.mark.parametrize("kind", sorted(ENCODERS))
@given(seed=SEEDS, height=st.integers(1, 40), width=st.integers(1, 40))
def test_pages_come_back_bit_for_bit(kind, seed, height, width):
    rng = np.random.default_rng(seed)
    page = rng.integers(0, 256, (height, width, 4), np.uint8)
    page[..., 3] = rng.choice(np.array([0, 255], np.uint8), (height, width))
    page[rng.random((height, width)) < 0.5] = page[0, 0]
    suffix, encode = ENCODERS[kind]
    assert suffix == f".{kind}"
    np.testing.assert_array_equal(decoded(encode(page), kind), page)


@pytest.mark.parametrize("kind", sorted(ENCODERS))
def test_what_repeats_downwards_costs_next_to_nothing(kind):
    row = np.random.default_rng(1).integers(0, 256, (1, 256, 4), np.uint8)
    row[..., 3] = 255
    page = np.repeat(row, 256, axis=0)
    data = ENCODERS[kind][1](page)
    np.testing.assert_array_equal(decoded(data, kind), page)
    assert len(data) < 3000


def predicted(kind, left, above, corner):
    """ISO/IEC 15948, table 9.1 and section 9.4."""
    if kind == 4:
        p = left + above - corner
        return min((left, above, corner), key=lambda byte: abs(p - byte))
    return {1: left, 2: above}[kind]


@given(seed=SEEDS, height=st.integers(1, 6), width=st.integers(1, 9), texel=st.integers(1, 4))
def test_filters_are_the_standards_and_the_best_of_each_row(seed, height, width, texel):
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, 256, (height, width * texel), np.uint8)
    rows[rng.random(rows.shape) < 0.3] = 128
    rows[1:][rng.random(height - 1) < 0.3] = rows[0]
    padded = np.zeros((height + 1, width * texel + texel), int)
    padded[1:, texel:] = rows
    out = filtered(rows, texel)
    for row in range(height):
        tried = {
            kind: [
                int(value - predicted(kind, left, above, corner)) % 256
                for value, left, above, corner in zip(
                    rows[row].tolist(),
                    padded[row + 1].tolist(),
                    padded[row, texel:].tolist(),
                    padded[row].tolist(),
                    strict=False,
                )
            ]
            for kind in (1, 2, 4)
        }
        sums = {kind: sum(min(b, 256 - b) for b in line) for kind, line in tried.items()}
        assert out[row, 1:].tolist() == tried[out[row, 0]]
        assert sums[out[row, 0]] == min(sums.values())
