"""Atlas files, decoded by Pillow, bit for bit."""

import io

import numpy as np
import pytest
from farfield_worker.compile.encode import ENCODERS
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
