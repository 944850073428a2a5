"""What differs between two scenes."""

from collections import Counter

import numpy as np
import pytest
from farfield_worker.reuse.changes import changes
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.scenes import SceneWriter


def boxes(folder, places, block_triangles=64, color=(1, 1, 1, 1), picture=None, **batch):
    """A scene of small boxes at `places`, drawn in this order."""
    writer = SceneWriter()
    if picture is not None:
        batch["texture"] = writer.texture(picture)
    number = writer.batch(**batch)
    for x, y, z in places:
        writer.box(number, (x, y, z), (x + 1, y + 1, z + 1), color=color)
    return writer.write(folder, block_triangles)


def corners(scene, triangles):
    """Corner positions of triangles, as a multiset."""
    found = np.asarray(scene.positions)[np.asarray(scene.triangles)[triangles]]
    return Counter(found.reshape(-1, 9).astype(np.float32).tobytes()[i * 36 : i * 36 + 36]
                   for i in range(len(triangles)))  # fmt: skip


@settings(max_examples=25)
@given(
    st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=1, max_size=8),
    st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=1, max_size=8),
    st.sampled_from([8, 12, 50]),
    st.randoms(use_true_random=False),
)
def test_triangles_are_compared_whatever_their_order(tmp_path_factory, old, new, size, random):
    folder = tmp_path_factory.mktemp("scenes")
    shuffled = old + new
    random.shuffle(shuffled)
    first = boxes(folder / "first", old + new, 64)
    same = boxes(folder / "same", shuffled, size)
    for part in changes(first, same):
        assert len(part) == 0
    second = boxes(folder / "second", new, size)
    found = changes(first, second)
    before = corners(first, np.arange(len(first.triangles)))
    after = corners(second, np.arange(len(second.triangles)))
    # the slow way: whatever is not there as often
    uneven = {shape for shape in before | after if before[shape] != after[shape]}
    assert corners(first, found.gone) == Counter({s: n for s, n in before.items() if s in uneven})
    assert corners(second, found.come) == Counter({s: n for s, n in after.items() if s in uneven})


PICTURE = np.full((4, 4, 4), 200, np.uint8)


@pytest.mark.parametrize(
    "otherwise",
    [
        {"color": (1, 1, 0.99, 1)},
        {"double_sided": True},
        {"alpha": "mask"},
        {"picture": PICTURE - np.uint8(1)},
        {"unlit": True},
    ],
    ids=str,
)
def test_looks_count(tmp_path, otherwise):
    places = [(0, 0, 0), (5, 0, 0)]
    plain = boxes(tmp_path / "plain", places, picture=PICTURE)
    other = boxes(tmp_path / "other", places, **{"picture": PICTURE} | otherwise)
    found = changes(plain, other)
    assert len(found.gone) == len(found.come) == 24


def test_scenes_with_other_origins_differ(tmp_path):
    scenes = []
    for n, origin in enumerate([(0, 0, 0), (8, 0, 0)]):
        writer = SceneWriter(origin)
        writer.box(writer.batch(), (8, 0, 0), (9, 1, 1))
        writer.box(writer.batch(), (16, 0, 0), (17, 1, 1))
        scenes.append(writer.write(tmp_path / str(n)))
    found = changes(*scenes)
    assert len(found.gone) == len(found.come) == 24
