"""Compiled faces on pages, and quad columns as docs/format.md has them."""

import numpy as np
import pytest
from farfield_core import faces as face_axes
from farfield_core import placement
from farfield_worker.compile.atlas import lay_out
from farfield_worker.compile.layered import CompiledFace, Rules, cut, shown_texels
from farfield_worker.compile.quads import layer_quads
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.layered_faces import RESOLUTIONS, SEEDS, random_face

HALF = (1.0, 1.0, 1.0)


def compiled(seed, resolution, layers, grower, largest, numbers):
    rules = Rules(
        placement.place(HALF, max(resolution, 16), layers).layers, resolution, grower, largest
    )
    return rules.layers, {
        number: cut(
            shown_texels(random_face(seed + number, resolution, layers + 1), rules, HALF), rules
        )
        for number in numbers
    }


def columns_of(quads):
    """The columns of docs/format.md as arrays, corners (n, 4, 2)."""
    n = len(quads.faces)
    assert quads.eyes == (0,) * n
    assert quads.corner_counts == (4,) * n
    assert quads.scales == (1.0,) * n
    corners = np.array(quads.corners).reshape(n, 4, 2)
    offsets = np.array(quads.offsets).reshape(n, 2)
    planes = np.array(quads.planes).reshape(n, 3)
    return corners, offsets, planes


@given(
    seed=SEEDS,
    resolution=RESOLUTIONS,
    layers=st.integers(1, 6),
    grower=st.sampled_from(["greedy", "best"]),
    numbers=st.sets(st.integers(0, 5), max_size=3),
)
@settings(max_examples=60)
def test_every_texel_is_found_back(seed, resolution, layers, grower, numbers):
    """As a reader does it: from each texel's centre through scale and offset to the page."""
    page = (40, 56)
    distances, compiled_faces = compiled(seed, resolution, layers, grower, 38, sorted(numbers))
    boxes, places, pages = lay_out(compiled_faces, resolution, page)
    quads = layer_quads(boxes, places, distances)
    corners, offsets, _ = columns_of(quads)
    assert pages.shape[1:] == (page[1], page[0], 4)
    assert pages.dtype == np.uint8
    assert set(quads.pages) == set(range(len(pages)))
    found = {number: {} for number in compiled_faces}
    for q, face in enumerate(quads.faces):
        low, high = corners[q].min(axis=0).astype(int), corners[q].max(axis=0).astype(int)
        for row in range(low[1], high[1]):
            for column in range(low[0], high[0]):
                at = np.array([column + 0.5, row + 0.5])
                along = at[::-1] if quads.turned[q] else at
                x, y = along * quads.scales[q] + offsets[q]
                color = pages[quads.pages[q], int(np.floor(y)), int(np.floor(x))]
                if color[3] >= 128:
                    key = (quads.layers[q], row * resolution + column)
                    assert key not in found[face]
                    found[face][key] = color.tolist()
    for number, face in compiled_faces.items():
        layer = face.boxes[face.owner, 0]
        color = face.color.view(np.uint8).reshape(-1, 4)
        expected = {
            (int(on), int(t)): c.tolist() for on, t, c in zip(layer, face.texel, color, strict=True)
        }
        assert found[number] == expected


@given(seed=SEEDS, layers=st.integers(1, 6))
@settings(max_examples=30)
def test_quads_go_round_and_lie_on_their_layer_front_to_back(seed, layers):
    resolution = 32
    distances, compiled_faces = compiled(seed, resolution, layers, "best", 38, [0, 4])
    boxes, places, _ = lay_out(compiled_faces, resolution, (40, 40))
    quads = layer_quads(boxes, places, distances)
    corners, _, planes = columns_of(quads)
    assert np.all(np.diff(quads.layers) <= 0)
    for q, (face, on) in enumerate(zip(quads.faces, quads.layers, strict=True)):
        (x0, y0), (x1, y1) = corners[q, 0], corners[q, 2]
        assert corners[q].tolist() == [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
        assert x0 < x1
        assert y0 < y1
        # the homogeneous position of docs/format.md is the layer's plane
        uv = 2 * corners[q] / resolution - 1
        d = uv @ planes[q, :2] + planes[q, 2]
        points = face_axes.directions(face, *uv.T) / d[:, None]
        depth = points @ np.array(face_axes.FACES[face].forward)
        np.testing.assert_allclose(depth, distances[on])


def test_what_is_higher_than_wide_lies_down():
    texel = np.arange(5, dtype=np.int32) * 16 + 3
    color = np.arange(1, 6, dtype=np.uint32) | np.uint32(0xFF000000)
    box = np.array([[0, 3, 0, 1, 5]], np.int32)
    face = CompiledFace(texel, color, np.zeros(5, np.int32), box, 5, 0)
    boxes, places, pages = lay_out({2: face}, 16, (16, 8))
    quads = layer_quads(boxes, places, [10.0])
    assert quads.turned == (1,)
    assert pages[0, 1, 1:6, 0].tolist() == [1, 2, 3, 4, 5]


def places_of(colors):
    """Columns where rectangles of one texel with these colours, (n,) uint32 RGB, are put."""
    count = len(colors)
    box = np.array([[n, 0, 0, 1, 1] for n in range(count)], np.int32)
    face = CompiledFace(
        np.zeros(count, np.int32),
        colors | np.uint32(0xFF000000),
        np.arange(count, dtype=np.int32),
        box,
        count,
        0,
    )
    boxes, places, _ = lay_out({0: face}, 16, (64, 8))
    out = np.empty(count, np.int32)
    out[boxes.layer] = places.x
    return out


def test_alike_lie_together():
    """Greys of one size come in the order of their brightness, whatever their layer."""
    levels = np.random.default_rng(1).permutation(20).astype(np.uint32)
    found = places_of(levels * np.uint32(0x010101))
    np.testing.assert_array_equal(np.argsort(found), np.argsort(levels))


def test_colours_as_bright_lie_apart():
    """Of three colours that are as bright, each one's rectangles lie side by side."""
    colors = np.array([0x0000B4, 0x00B400, 0x3C3C3C], np.uint32)
    which = np.random.default_rng(2).integers(0, 3, 18)
    found = places_of(colors[which])
    assert np.count_nonzero(np.diff(which[np.argsort(found)])) == 2


def test_no_faces():
    boxes, places, pages = lay_out({}, 64, (32, 32))
    assert pages.shape == (0, 32, 32, 4)
    assert len(layer_quads(boxes, places, [10.0]).faces) == 0


@pytest.mark.parametrize("grower", ["greedy", "best"])
def test_compile_face_keeps_what_was_rendered_in_front(grower):
    """The nearest layer loses nothing, and counts tell what happened to the others."""
    resolution = 70
    for seed in range(20):
        face = random_face(seed, resolution, 5)
        rules = Rules(placement.place(HALF, 70, 4).layers, resolution, grower, 1000)
        out = cut(shown_texels(face, rules, HALF), rules)
        layer = out.boxes[out.owner, 0]
        assert (np.diff(layer.astype(np.int64) * resolution**2 + out.texel) > 0).all()
        assert out.rendered == int((face.layer < 4).sum())
        nearest = face.layer == 3
        kept = layer == 3
        front = dict(zip(out.texel[kept].tolist(), out.color[kept].tolist(), strict=True))
        rendered = zip(
            face.texel[nearest].tolist(),
            face.color[nearest].view(np.uint32).ravel().tolist(),
            strict=True,
        )
        assert all(front[texel] == color for texel, color in rendered)
        own = {(int(on), int(t)) for on, t in zip(face.layer, face.texel, strict=True) if on < 4}
        added = {(int(on), int(t)) for on, t in zip(layer, out.texel, strict=True)} - own
        assert out.filled == len(added)
