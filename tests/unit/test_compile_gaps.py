"""Gap filling against loops that say the rule texel by texel."""

import numpy as np
from farfield_worker.compile import bitplanes
from farfield_worker.compile.gaps import columns, fill_gaps, sources
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.layered_faces import (
    RESOLUTIONS,
    SEEDS,
    by_texel,
    dense,
    packed,
    random_face,
    random_planes,
    unpacked,
)


def expected_fill(planes, rings):
    """LEMI section 5: q on layer i + 1, a neighbour p on layer i, nothing at q on layer i."""
    out = np.zeros_like(planes[:-1])
    for i, row, column in np.argwhere(out == 0):
        rows = slice(max(row - rings, 0), row + rings + 1)
        around = planes[i, rows, max(column - rings, 0) : column + rings + 1]
        out[i, row, column] = (
            planes[i + 1, row, column] and not planes[i, row, column] and around.any()
        )
    return out


@given(
    seed=SEEDS,
    resolution=RESOLUTIONS,
    layers=st.integers(1, 3),
    rings=st.integers(1, 3),
    faces=st.booleans(),
)
def test_fill_gaps(seed, resolution, layers, rings, faces):
    if faces:
        planes = dense(random_face(seed, resolution, layers + 1), layers + 1, resolution)
    else:
        planes = random_planes(seed, layers + 1, resolution)
    bits = packed(planes)
    before = bits.copy()
    np.testing.assert_array_equal(unpacked(fill_gaps(bits, rings)), expected_fill(planes, rings))
    np.testing.assert_array_equal(bits, before)


@given(seed=SEEDS, resolution=RESOLUTIONS, layers=st.integers(1, 8))
def test_filled_texels_take_the_next_colour_in_front(seed, resolution, layers):
    face = random_face(seed, resolution, layers + 1)
    planes = packed(dense(face, layers + 1, resolution))
    texel, layer = bitplanes.listed(planes[:layers] | fill_gaps(planes, 1))
    colors = face.color.view(np.uint32).ravel()
    got = colors[sources(columns(face.texel, resolution), face.layer, texel, layer)]
    fragments = by_texel(face, resolution)
    for t, on, color in zip(texel, layer, got, strict=True):
        column = fragments[divmod(int(t), resolution)]
        assert color == next(f.color for f in column if f.layer >= on)


def test_a_corner_is_a_neighbour_and_two_texels_are_too_far():
    planes = np.zeros((2, 8, 8), bool)
    planes[0, 3, 3] = planes[1, 4, 4] = planes[1, 3, 5] = True
    filled = unpacked(fill_gaps(packed(planes), 1))
    assert np.argwhere(filled).tolist() == [[0, 4, 4]]


def test_a_silhouette_over_layers_between_is_not_filled():
    planes = np.zeros((3, 8, 8), bool)
    planes[0, :, :4] = planes[2, :, 4:] = True
    assert not fill_gaps(packed(planes), 1).any()
