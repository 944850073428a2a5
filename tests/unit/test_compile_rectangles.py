"""Rectangle growers: a partition of the texels, and what each promises of its rectangles."""

import numpy as np
import pytest
from farfield_worker.compile import best as best_module
from farfield_worker.compile.best import best
from farfield_worker.compile.greedy import greedy
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import RESOLUTIONS, SEEDS, random_planes

LAYERS = st.integers(1, 4)
LONGEST = st.one_of(st.integers(1, 8), st.just(1000))


def cut(grower, planes, longest):
    """Texels, layers, owners and boxes of dense planes."""
    layer, row, column = np.nonzero(planes)
    texel = (row * planes.shape[1] + column).astype(np.int32)
    owner = np.full(len(texel), -1, np.int32)
    boxes = np.full((len(texel), 5), -1, np.int32)
    count = grower(texel, layer.astype(np.int16), planes.shape[1], longest, longest, owner, boxes)
    assert (boxes[count:] == -1).all()
    return texel, layer, owner, boxes[:count]


def fills(planes, texel, layer, owner, boxes, longest):
    """Check that rectangles partition the texels; how full each is, (n,)."""
    resolution = planes.shape[1]
    assert ((owner >= 0) & (owner < len(boxes))).all()
    row, column = np.divmod(texel, resolution)
    for on, y, x, box in zip(layer, row, column, boxes[owner], strict=True):
        assert on == box[0]
        assert box[1] <= x < box[1] + box[3]
        assert box[2] <= y < box[2] + box[4]
    _, x, y, width, height = boxes.T
    assert (x >= 0).all()
    assert (y >= 0).all()
    assert (x + width <= resolution).all()
    assert (y + height <= resolution).all()
    assert ((width >= 1) & (width <= longest)).all()
    assert ((height >= 1) & (height <= longest)).all()
    own = np.bincount(owner, minlength=len(boxes))
    assert (own >= 1).all()
    return own / (width * height)


def plain_greedy(plane, longest):
    """The rule of LEMI section 5, word for word: (x, y, width, height) of each rectangle."""
    free, size, out = plane.copy(), len(plane), []
    for top in range(size):
        for left in range(size):
            if not free[top, left]:
                continue
            width, height = 1, 1
            grew = True
            wider = higher = True
            while grew:
                grew = False
                if wider and left + width < size and width < longest:
                    wider = bool(free[top : top + height, left + width].all())
                    width, grew = width + wider, grew or wider
                else:
                    wider = False
                if higher and top + height < size and height < longest:
                    higher = bool(free[top + height, left : left + width].all())
                    height, grew = height + higher, grew or higher
                else:
                    higher = False
            free[top : top + height, left : left + width] = False
            out.append((left, top, width, height))
    return out


@given(seed=SEEDS, layers=LAYERS, resolution=RESOLUTIONS, longest=LONGEST)
def test_greedy(seed, layers, resolution, longest):
    planes = random_planes(seed, layers, resolution)
    texel, layer, owner, boxes = cut(greedy, planes, longest)
    assert (fills(planes, texel, layer, owner, boxes, longest) == 1).all()
    expected = [(on, *box) for on in range(layers) for box in plain_greedy(planes[on], longest)]
    assert [tuple(box) for box in boxes.tolist()] == expected


@given(seed=SEEDS, layers=LAYERS, resolution=RESOLUTIONS, longest=LONGEST)
@settings(max_examples=200)
def test_best(seed, layers, resolution, longest):
    planes = random_planes(seed, layers, resolution)
    texel, layer, owner, boxes = cut(best, planes, longest)
    fills(planes, texel, layer, owner, boxes, longest)
    assert len(texel) >= best_module.FULL * (boxes[:, 3] * boxes[:, 4]).sum()
    assert (np.diff(boxes[:, 0]) >= 0).all()
    assert len(boxes) <= len(cut(greedy, planes, longest)[3])


def around(i, j):
    """The box (left, top, right, bottom) around two, and its area less theirs."""
    box = (*np.minimum(i[:2], j[:2]), *np.maximum(i[2:], j[2:]))
    return tuple(int(n) for n in box), area(box) - area(i) - area(j)


def area(box):
    return int((box[2] - box[0]) * (box[3] - box[1]))


def plain_merge(boxes, texels, longest):
    """Always the cheapest pair, found by comparing all with all; ends where `_merge` must."""
    boxes = [(on, (x, y, x + w, y + h)) for on, x, y, w, h in boxes]
    while True:
        pairs = []
        for n, (on, i) in enumerate(boxes):
            for other, j in boxes[:n]:
                box, added = around(i, j)
                fits = box[2] - box[0] <= longest and box[3] - box[1] <= longest
                if on == other and fits:
                    pairs.append((added, on, box))
        total = sum(area(box) for _, box in boxes)
        if not pairs or (total + min(pairs)[0]) * best_module.FULL > texels:
            return boxes
        _, on, box = min(pairs)
        inside = [other == on and around(box, j)[0] == box for other, j in boxes]
        boxes = [b for b, gone in zip(boxes, inside, strict=True) if not gone] + [(on, box)]


@given(seed=SEEDS, layers=st.integers(1, 2), resolution=st.integers(4, 12), longest=LONGEST)
@settings(max_examples=60)
def test_merging_against_the_plain_rule(seed, layers, resolution, longest):
    """Which of two equally cheap merges comes first is free, so numbers may differ a little."""
    planes = random_planes(seed, layers, resolution)
    texel, _, _, boxes = cut(greedy, planes, longest)
    merged = best_module._merge(boxes, len(texel), 1024, 2**30, longest, longest)
    expected = plain_merge(boxes.tolist(), len(texel), longest)
    assert len(merged) <= len(expected) * 1.1 + 2
    assert len(expected) <= len(merged) * 1.1 + 2
    assert len(texel) >= best_module.FULL * (merged[:, 3] * merged[:, 4]).sum()


def test_the_cheapest_pair_goes_first():
    """Two pairs of unit squares, the one apart by a gap, the other by two; room for one merge."""
    boxes = np.array([[0, 0, 0, 1, 1], [0, 2, 0, 1, 1], [1, 0, 0, 1, 1], [1, 3, 0, 1, 1]], np.int32)
    merged = best_module._merge(boxes, 4, 1024, 2**30, 1000, 1000)
    assert sorted(merged.tolist()) == [[0, 0, 0, 3, 1], [1, 0, 0, 1, 1], [1, 3, 0, 1, 1]]
    assert len(best_module._merge(boxes, 4, 1024, 0, 1000, 1000)) == 4
    assert len(best_module._merge(boxes, 4, 1024, 2**30, 2, 1000)) == 4
    assert len(best_module._merge(boxes, 4, 1, 2**30, 1000, 1000)) == 4


@pytest.mark.parametrize("grower", [greedy, best])
def test_no_texels(grower):
    assert len(cut(grower, np.zeros((2, 8, 8), bool), 1000)[3]) == 0


@pytest.mark.parametrize("grower", [greedy, best])
def test_a_full_rectangle_is_one(grower):
    planes = np.zeros((2, 70, 70), bool)
    planes[1, 3:66, 2:67] = True
    assert cut(grower, planes, 1000)[3].tolist() == [[1, 2, 3, 65, 63]]


def test_best_needs_fewer_on_a_slope():
    planes = (np.tri(64) > 0)[None] & (np.tri(64, k=-12) == 0)[None]
    assert 3 * len(cut(best, planes, 1000)[3]) < len(cut(greedy, planes, 1000)[3])
