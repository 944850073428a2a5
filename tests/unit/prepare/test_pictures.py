"""The map and the thumbnail."""

from __future__ import annotations

import numpy as np
import pytest
from farfield_core.scene import SceneInfo
from farfield_worker.prepare import prepare
from farfield_worker.prepare.camera import look_at_box, top_view
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.unit.prepare.build import Gltf, flat_color

FLOOR = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], "f4")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory) -> tuple[SceneInfo, np.ndarray, np.ndarray]:
    """Four unlit floors, red at low x and z, one of them masked away, one of them glass."""
    folder = tmp_path_factory.mktemp("pictures")
    gltf = Gltf()
    holes = gltf.texture(flat_color(255, 255, 255))
    pixels = flat_color(0, 255, 0)
    pixels[1, 1, 3] = 0
    leaf = gltf.texture(pixels)
    unlit = {"extensions": {"KHR_materials_unlit": {}}}
    looks = [
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}} | unlit,
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": holes}}} | unlit,
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": leaf}}, "alphaMode": "MASK"}
        | unlit,
        {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 0.5]}, "alphaMode": "BLEND"} | unlit,
    ]
    # the masked floor shows its transparent quarter only
    uvs = np.full((4, 2), 0.75, "f4")
    for n, look in enumerate(looks):
        gltf.add("materials", look)
        floor = gltf.mesh(gltf.quad(n, POSITION=FLOOR, TEXCOORD_0=uvs))
        gltf.node(mesh=floor, translation=[100 + 10 * (n % 2), 0, 10 * (n // 2)], scale=[10, 1, 10])
    info = prepare(gltf.write(folder), folder / "out", "s", "n")
    with (
        Image.open(folder / "out" / "map.png") as top,
        Image.open(folder / "out" / "thumbnail.png") as thumbnail,
    ):
        return info, np.asarray(top), np.asarray(thumbnail)


def colour_at(info: SceneInfo, pixels: np.ndarray, x: float, z: float) -> np.ndarray:
    view = info.map
    assert view is not None
    column = int((x - view.min[0]) / (view.max[0] - view.min[0]) * view.width)
    row = int((z - view.min[1]) / (view.max[1] - view.min[1]) * view.height)
    return pixels[row, column]


def test_map_shows_what_is_where(pictures):
    info, top, _ = pictures
    assert top.shape == (info.map.height, info.map.width, 4)
    assert colour_at(info, top, 105, 5).tolist() == [255, 0, 0, 255]
    assert colour_at(info, top, 115, 5).tolist() == [255, 255, 255, 255]
    assert colour_at(info, top, 105, 15)[3] == 0
    glass = colour_at(info, top, 115, 15)
    assert glass[:3].tolist() == [0, 0, 255]
    assert 0 < glass[3] < 255
    assert top[0, 0, 3] == 0


def test_thumbnail_shows_the_scene_before_the_sky(pictures):
    _, _, thumbnail = pictures
    assert thumbnail.shape == (384, 512, 3)
    red = (thumbnail == (255, 0, 0)).all(axis=-1).mean()
    assert red > 0.03
    # the camera looks down on the scene: from the horizon's colour to the ground's
    sky = thumbnail[2, 256].astype(int)
    assert sky[2] >= sky[0]


boxes = st.tuples(*[st.floats(-100, 100)] * 3, *[st.floats(0, 1000)] * 3)


@given(boxes)
def test_top_view_rectangle_is_what_the_camera_sees(box):
    low = np.array(box[:3])
    high = low + np.array(box[3:])
    camera, (least, most), (width, height) = top_view(low, high, 256)
    assert min(width, height) >= 1
    assert max(width, height) <= 256
    for x, z, column, row in ((least[0], least[1], -1, 1), (most[0], most[1], 1, -1)):
        clip = camera.matrix @ (x, low[1], z, 1)
        assert clip[:2] == pytest.approx((column, row), abs=1e-4)
    for corner in (low, high):
        clip = camera.matrix @ (*corner, 1)
        assert np.abs(clip[:3]).max() <= 1 + 1e-6
    metres = (most - least) / (width, height)
    assert metres[0] == pytest.approx(metres[1])


@given(boxes, st.floats(0.5, 2))
def test_thumbnail_holds_the_whole_box(box, aspect):
    low = np.array(box[:3])
    high = low + np.array(box[3:]) + 1e-3
    camera = look_at_box(low, high, aspect)
    corners = np.array(
        [
            [x, y, z, 1]
            for x in (low[0], high[0])
            for y in (low[1], high[1])
            for z in (low[2], high[2])
        ]
    )
    clip = corners @ camera.matrix.T
    assert (clip[:, 3] > 0).all()
    seen = clip[:, :3] / clip[:, 3:]
    assert np.abs(seen).max() <= 1.001
    # no smaller than it must be
    assert np.abs(seen[:, :2]).max() > 0.8
