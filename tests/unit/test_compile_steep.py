"""Gap filling over skipped layers against the rule said fragment by fragment, and its purpose."""

import numpy as np
from farfield_worker.compile.gaps import columns
from farfield_worker.compile.hidden import hidden
from farfield_worker.compile.steep import EXACT, IN_LINE, REACH, fill_steep
from farfield_worker.render.interface import FaceTexels
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import (
    RESOLUTIONS,
    SEEDS,
    dense,
    packed,
    random_face,
    unpacked,
)


def goes_on(fragments, p, q, a, b):
    """Whether the line through a at p and b at q, (row, column), meets a third fragment."""
    step = 1 / b - 1 / a
    row, column = q[0] - p[0], q[1] - p[1]
    off = []
    for at, wanted in (
        ((p[0] - row, p[1] - column), 1 / a - step),
        ((q[0] + row, q[1] + column), 1 / b + step),
    ):
        there = [abs(1 / depth - wanted) for _, depth in fragments.get(at, ())]
        off.append(min(there, default=np.inf))
    return max(off) <= IN_LINE * step or min(off) <= EXACT * step


def expected_fill(face, layers, resolution, rings):
    """All (layer, row, column) that some pair of fragments asks for, covered or not."""
    fragments = {}
    for texel, layer, depth in zip(face.texel, face.layer, face.depth, strict=True):
        at = divmod(int(texel), resolution)
        fragments.setdefault(at, []).append((int(layer), float(depth)))
    out = np.zeros((layers, resolution, resolution), bool)
    around = [n for n in range(-rings, rings + 1) if n != 0]
    for q, here in fragments.items():
        beside = [(q[0] + n, q[1]) for n in around] + [(q[0], q[1] + n) for n in around]
        for p in beside:
            for j, b in here:
                for i, a in fragments.get(p, ()):
                    if j - REACH <= i < j - 1 and goes_on(fragments, p, q, a, b):
                        out[i : min(j, layers), q[0], q[1]] = True
    return out


# three fragments of one texel may lie in line, which is no surface
@example(seed=57, resolution=47, layers=5, rings=1, beyond=2)
@given(
    seed=SEEDS,
    resolution=RESOLUTIONS,
    layers=st.integers(1, 12),
    rings=st.integers(1, 2),
    beyond=st.integers(0, 2),
)
@settings(max_examples=60)
def test_fill_steep(seed, resolution, layers, rings, beyond):
    face = random_face(seed, resolution, layers + beyond, most=200)
    covered = dense(face, layers, resolution)
    filled = fill_steep(face, columns(face.texel, resolution), packed(covered), rings)
    expected = expected_fill(face, layers, resolution, rings)
    np.testing.assert_array_equal(unpacked(filled), expected & ~covered)


@given(seed=SEEDS, resolution=RESOLUTIONS, layers=st.integers(1, 8))
def test_gaps_that_nobody_sees_need_no_filling(seed, resolution, layers):
    """With and without them the same texels are left in the end."""
    face = random_face(seed, resolution, layers + 1)
    planes, starts = packed(dense(face, layers, resolution)), columns(face.texel, resolution)
    shifts = [(1, 1)] * (layers - 1)
    left = []
    for closed in (planes, planes | hidden(planes, shifts)):
        covered = planes | fill_steep(face, starts, closed, 1)
        left.append(covered & ~hidden(covered, shifts))
    np.testing.assert_array_equal(*left)


def face_of(resolution, cells):
    """A face with fragments {(row, column): [(layer, disparity), ...]}."""
    rows = sorted(
        (row * resolution + column, layer, disparity)
        for (row, column), fragments in cells.items()
        for layer, disparity in fragments
    )
    texel, layer, disparity = zip(*rows, strict=True)
    color = np.arange(len(rows) * 4, dtype=np.uint8).reshape(-1, 4)
    depth = (1 / np.array(disparity)).astype(np.float32)
    return FaceTexels(np.array(texel, np.int32), np.array(layer, np.int16), color, depth)


def filled_in(face, layers, resolution):
    planes = packed(dense(face, layers, resolution))
    out = fill_steep(face, columns(face.texel, resolution), planes, 1)
    return {tuple(int(n) for n in at) for at in np.argwhere(unpacked(out))}


def test_a_silhouette_is_not_filled_but_a_steep_wall_is():
    silhouette = {(2, c): [(0 if c < 4 else 3, 0.1 if c < 4 else 0.4)] for c in range(8)}
    assert filled_in(face_of(8, silhouette), 4, 8) == set()
    wall = {(2, c): [(2 * c, 0.1 + 0.1 * c)] for c in range(4)}
    expected = {(2 * c - back, 2, c) for c in range(1, 4) for back in (1, 2)}
    assert filled_in(face_of(8, wall), 8, 8) == expected


def test_a_wall_that_ends_must_be_straight():
    """Three fragments in line; the fourth is missing, so the third has to be exact."""
    for bend, found in ((0.0, True), (0.2 * EXACT, True), (3 * EXACT, False)):
        cells = {(2, 0): [(0, 0.1)], (2, 1): [(2, 0.2)], (2, 2): [(4, 0.3 + 0.1 * bend)]}
        assert bool(filled_in(face_of(4, cells), 5, 4)) == found


def test_what_lies_inside_the_near_field_is_continued_but_not_stored():
    cells = {(1, c): [(c and 2 * c - 1, 0.1 + 0.1 * c)] for c in range(3)}
    filled = filled_in(face_of(4, cells), 2, 4)
    assert {layer for layer, _, _ in filled} <= {0, 1}
    assert (1, 1, 2) in filled


def test_jumps_over_too_many_layers_are_not_filled():
    for jump in (REACH, REACH + 1):
        wall = {(2, c): [(jump * c, 0.1 + 0.1 * c)] for c in range(3)}
        assert bool(filled_in(face_of(8, wall), 2 * jump + 1, 8)) == (jump == REACH)


def test_an_empty_face():
    face = random_face(0, 4, 1)._replace(
        texel=np.empty(0, np.int32),
        layer=np.empty(0, np.int16),
        color=np.empty((0, 4), np.uint8),
        depth=np.empty(0, np.float32),
    )
    nothing = packed(np.zeros((3, 4, 4), bool))
    assert not fill_steep(face, columns(face.texel, 4), nothing, 1).any()
