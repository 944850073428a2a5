"""Gap filling against loops that say the rule texel by texel."""

import numpy as np
from farfield_worker.compile import bitplanes, gaps
from farfield_worker.compile.gaps import IN_LINE, columns, fill_gaps, sources
from farfield_worker.render.interface import FaceTexels
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import (
    RESOLUTIONS,
    SEEDS,
    by_texel,
    dense,
    packed,
    random_face,
    unpacked,
)


def in_line(fragments, texel, wanted, tolerance):
    return any(abs(f.disparity - wanted) <= tolerance for f in fragments.get(texel, []))


def one_surface(fragments, p, far, q, near):
    """Whether the line from fragment `far` at p to `near` at q goes on before p or after q."""
    step = near.disparity - far.disparity
    tolerance = np.float64(IN_LINE) * abs(step)
    before = (2 * p[0] - q[0], 2 * p[1] - q[1])
    after = (2 * q[0] - p[0], 2 * q[1] - p[1])
    return in_line(fragments, before, far.disparity - step, tolerance) or in_line(
        fragments, after, near.disparity + step, tolerance
    )


def expected_fill(face, layers, resolution, rings, reach):
    """For every fragment and each farther one around it: the layers from that one up to it."""
    fragments = by_texel(face, resolution)
    out = np.zeros((layers, resolution, resolution), bool)
    around = range(-rings, rings + 1)
    for q, near_ones in fragments.items():
        neighbours = [(q[0] + y, q[1] + x) for y in around for x in around]
        for near in near_ones:
            for p in neighbours:
                for far in fragments.get(p, []):
                    jump = near.layer - far.layer
                    if not 1 <= jump <= reach:
                        continue
                    if jump == 1 or one_surface(fragments, p, far, q, near):
                        out[far.layer : near.layer, q[0], q[1]] = True
    return out & ~dense(face, layers, resolution)


@given(
    seed=SEEDS,
    resolution=RESOLUTIONS,
    layers=st.integers(1, 12),
    beyond=st.integers(0, 2),
    rings=st.integers(1, 2),
    reach=st.integers(1, 8),
)
@settings(max_examples=150)
def test_fill_gaps(seed, resolution, layers, beyond, rings, reach):
    face = random_face(seed, resolution, layers + beyond)
    planes = packed(dense(face, layers, resolution))
    before = planes.copy()
    filled = fill_gaps(face, columns(face, resolution), planes, rings, reach)
    np.testing.assert_array_equal(
        unpacked(filled), expected_fill(face, layers, resolution, rings, reach)
    )
    np.testing.assert_array_equal(planes, before)


@given(seed=SEEDS, resolution=RESOLUTIONS, layers=st.integers(1, 8))
def test_filled_texels_take_the_next_colour_in_front(seed, resolution, layers):
    face = random_face(seed, resolution, layers + 1)
    planes = packed(dense(face, layers, resolution))
    starts = columns(face, resolution)
    filled = fill_gaps(face, starts, planes, 1, 8)
    texel, layer = bitplanes.listed(planes | filled)
    colors = face.color.view(np.uint32).ravel()
    got = colors[sources(starts, face.layer, texel, layer)]
    fragments = by_texel(face, resolution)
    for t, on, color in zip(texel, layer, got, strict=True):
        column = fragments[divmod(int(t), resolution)]
        assert color == next(f.color for f in column if f.layer >= on)


def face_of(resolution, cells):
    """A face with fragments {(row, column): [(layer, disparity), ...]}."""
    rows = sorted(
        (row * resolution + column, layer, disparity)
        for (row, column), column_fragments in cells.items()
        for layer, disparity in column_fragments
    )
    texel, layer, disparity = zip(*rows, strict=True)
    color = np.arange(len(rows) * 4, dtype=np.uint8).reshape(-1, 4)
    depth = (1 / np.array(disparity)).astype(np.float32)
    return FaceTexels(np.array(texel, np.int32), np.array(layer, np.int16), color, depth)


def filled_in(face, layers, resolution, reach):
    planes = packed(dense(face, layers, resolution))
    out = fill_gaps(face, columns(face, resolution), planes, 1, reach)
    return {tuple(int(n) for n in at) for at in np.argwhere(unpacked(out))}


def test_the_papers_rule():
    face = face_of(8, {(3, 3): [(0, 0.1)], (4, 4): [(1, 0.2)], (4, 6): [(1, 0.2)]})
    assert filled_in(face, 2, 8, reach=1) == {(0, 4, 4)}


def test_a_silhouette_is_not_filled_but_a_steep_wall_is():
    silhouette = {(2, c): [(0 if c < 4 else 3, 0.1 if c < 4 else 0.4)] for c in range(8)}
    assert filled_in(face_of(8, silhouette), 4, 8, reach=8) == set()
    wall = {(2, c): [(2 * c, 0.1 + 0.1 * c)] for c in range(4)}
    expected = {(2 * c - back, 2, c) for c in range(1, 4) for back in (1, 2)}
    assert filled_in(face_of(8, wall), 8, 8, reach=8) == expected
    assert filled_in(face_of(8, wall), 8, 8, reach=1) == set()


def test_what_lies_inside_the_near_field_is_continued_but_not_stored():
    face = face_of(4, {(1, 1): [(1, 0.2)], (1, 2): [(2, 0.3)]})
    assert filled_in(face, 2, 4, reach=1) == {(1, 1, 2)}


def test_an_empty_face():
    face = random_face(0, 4, 1)._replace(
        texel=np.empty(0, np.int32),
        layer=np.empty(0, np.int16),
        color=np.empty((0, 4), np.uint8),
        depth=np.empty(0, np.float32),
    )
    assert not gaps.fill_gaps(face, columns(face, 4), bitplanes.empty(3, 4), 1, 8).any()
