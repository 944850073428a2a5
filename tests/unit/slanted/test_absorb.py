"""Small sheets are given up only where rings draw all that they captured."""

import numpy as np
from farfield_worker.slanted.absorb import MOST, absorb
from farfield_worker.slanted.grid import GROWTH, texel_starts
from farfield_worker.slanted.segment import Sheets
from hypothesis import given, settings

from tests.unit.slanted.random_scenes import RESOLUTION, Seen
from tests.unit.slanted.test_sheets import at, cut, filled, scenes


def oracle(seen: Seen, plane: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Which sheets stay, by looking at every small one in turn."""
    low2, high2 = seen.tolerance.interval(seen.disparity, 2.0)
    keep = np.ones(len(plane), bool)
    counted_on: set[int] = set()
    x, y = seen.texel % RESOLUTION, seen.texel // RESOLUTION

    def goes_on(s: int, f: int) -> bool:
        t = seen.texel[f]
        d = float(at(plane[s], t))
        if d < (abs(plane[s, 0]) + abs(plane[s, 1])) * (1 + 2 * GROWTH) / RESOLUTION:
            return False
        fits = [g for g in np.flatnonzero(seen.texel == t) if low2[g] <= d <= high2[g]]
        return bool(fits) and min(fits, key=lambda g: abs(seen.disparity[g] - d)) == f

    size = np.bincount(owner[owner >= 0], minlength=len(plane))
    for s in np.argsort(size, kind="stable"):
        if size[s] > MOST or s in counted_on:
            continue
        helpers = set()
        for f in np.flatnonzero(owner == s):
            beside = (abs(x - x[f]) <= 1) & (abs(y - y[f]) <= 1) & (seen.texel != seen.texel[f])
            others = [o for o in owner[beside] if o >= 0 and o != s and keep[o]]
            able = [o for o in dict.fromkeys(others) if goes_on(o, f)]
            if not able:
                break
            helpers.add(int(able[0]))
        else:
            keep[s] = False
            counted_on |= helpers
    return keep


@given(scenes)
@settings(max_examples=60, deadline=None)
def test_what_is_given_up_is_drawn_by_rings(seen: Seen) -> None:
    sheets, _, _ = cut(seen)
    low2, high2 = seen.tolerance.interval(seen.disparity, 2.0)
    starts = texel_starts(seen.texel, RESOLUTION)
    left = absorb(sheets, seen.texel, starts, seen.disparity, low2, high2, RESOLUTION)
    keep = oracle(seen, sheets.plane, sheets.owner)
    np.testing.assert_array_equal(left.plane, sheets.plane[keep])
    np.testing.assert_array_equal(left.rect, sheets.rect[keep])
    kept = keep[sheets.owner]
    np.testing.assert_array_equal(left.owner >= 0, kept)
    np.testing.assert_array_equal(left.plane[left.owner[kept]], sheets.plane[sheets.owner[kept]])
    texels, _, _ = filled(seen, left)
    # nothing that was drawn is lost
    assert set(texels.fragment[texels.filled]) >= set(np.flatnonzero(~kept))
    before, _, _ = filled(seen, sheets)
    assert set(texels.fragment) >= set(before.fragment[~before.filled])


def test_a_texel_beside_a_wall_becomes_part_of_its_ring() -> None:
    texel = np.array([5, 6, 7, 8, 20], np.int32)
    # the last of the four lies a tolerance and a half before the wall of the others
    disparity = np.array([0.02, 0.02, 0.02, 0.02075, 0.02])
    sheets = Sheets(
        np.array([[5, 0, 8, 1], [8, 0, 9, 1], [20, 0, 21, 1]], np.int32),
        np.array([[0, 0, 0.02], [0, 0, 0.02075], [0, 0, 0.02]]),
        np.array([0, 0, 0, 1, 2], np.int32),
    )
    starts = texel_starts(texel, RESOLUTION)
    low2, high2 = disparity - 0.001, disparity + 0.001
    left = absorb(sheets, texel, starts, disparity, low2, high2, RESOLUTION)
    assert left.owner.tolist() == [0, 0, 0, -1, 1]
    # further off it stays
    low2[3] = 0.0201
    left = absorb(sheets, texel, starts, disparity, low2, high2, RESOLUTION)
    assert left.owner.tolist() == [0, 0, 0, 1, 2]
