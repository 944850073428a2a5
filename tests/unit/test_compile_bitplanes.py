"""Bit planes against dense arrays of booleans."""

import numpy as np
from farfield_worker.compile import bitplanes
from hypothesis import example, given
from hypothesis import strategies as st

from tests.unit.layered_faces import RESOLUTIONS, SEEDS, packed, random_planes, unpacked

LAYERS = st.integers(1, 5)


@given(seed=SEEDS, layers=LAYERS, resolution=RESOLUTIONS)
def test_put_and_listed(seed, layers, resolution):
    dense = random_planes(seed, layers, resolution)
    layer, row, column = np.nonzero(dense)
    texel, layer = (row * resolution + column).astype(np.int32), layer.astype(np.int16)
    planes = bitplanes.empty(layers, resolution)
    assert planes.shape == (layers, resolution, (resolution + 63) // 64)
    assert planes.dtype == np.uint64
    assert not planes.any()
    shuffled = np.random.default_rng(seed).permutation(len(texel))
    bitplanes.put(planes, texel[shuffled], layer[shuffled])
    np.testing.assert_array_equal(planes, packed(dense))

    # np.nonzero runs in the order of (layer, texel) that `listed` promises
    got_texel, got_layer = bitplanes.listed(planes)
    assert (got_texel.dtype, got_layer.dtype) == (np.int32, np.int16)
    np.testing.assert_array_equal(got_texel, texel)
    np.testing.assert_array_equal(got_layer, layer)


@given(seed=SEEDS, resolution=RESOLUTIONS, down=st.integers(0, 3), across=st.integers(0, 3))
@example(seed=1, resolution=70, down=1, across=1)
def test_erode(seed, resolution, down, across):
    dense = random_planes(seed, 1, resolution)[0]
    expected = np.zeros_like(dense)
    for row, column in np.argwhere(dense):
        rows, columns = (
            slice(row - down, row + down + 1),
            slice(column - across, column + across + 1),
        )
        inside = row >= down and column >= across
        inside = inside and row + down < resolution and column + across < resolution
        expected[row, column] = inside and dense[rows, columns].all()
    plane = packed(dense[None])[0]
    before = plane.copy()
    np.testing.assert_array_equal(unpacked(bitplanes.erode(plane, down, across)[None])[0], expected)
    np.testing.assert_array_equal(plane, before)


def test_erode_leaves_the_middle_of_a_full_face():
    plane = packed(np.ones((1, 65, 65), bool))[0]
    left = unpacked(bitplanes.erode(plane, 1, 2)[None])[0]
    expected = np.zeros((65, 65), bool)
    expected[1:-1, 2:-2] = True
    np.testing.assert_array_equal(left, expected)


@given(seed=SEEDS, resolution=RESOLUTIONS, rings=st.integers(0, 3))
def test_dilate(seed, resolution, rings):
    dense = random_planes(seed, 1, resolution)[0]
    expected = np.zeros_like(dense)
    for row, column in np.argwhere(dense):
        rows = slice(max(row - rings, 0), row + rings + 1)
        expected[rows, max(column - rings, 0) : column + rings + 1] = True
    plane = packed(dense[None])[0]
    before = plane.copy()
    inside = packed(np.ones((1, resolution, resolution), bool))[0]
    got = bitplanes.dilate(plane, rings) & inside
    np.testing.assert_array_equal(unpacked(got[None])[0], expected)
    np.testing.assert_array_equal(plane, before)
