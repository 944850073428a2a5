"""Renderers on a real scene: the culled one equals the plain loop, pyrender nearly so."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from farfield_core.placement import place
from farfield_core.scene import PreparedScene, open_scene
from farfield_worker.prepare import prepare
from farfield_worker.render.culled import CulledRenderer
from farfield_worker.render.interface import Renderer
from farfield_worker.render.plain import PlainRenderer
from farfield_worker.render.pyrender_renderer import PyrenderRenderer

from tests.corridors.scenes import DATA, SCENES

SCENE = SCENES["hotel_room"]
RESOLUTION = 128

pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not DATA.exists(), reason=f"there is no {DATA}; set FARFIELD_TEST_DATA"),
]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> PreparedScene:
    """The prepared scene."""
    folder = tmp_path_factory.mktemp("scene") / "prepared"
    prepare(SCENE.model, folder, SCENE.name, SCENE.name)
    return open_scene(folder)


@pytest.fixture(scope="module")
def culled(scene: PreparedScene) -> Iterator[Renderer]:
    """The default renderer."""
    renderer = CulledRenderer(scene)
    yield renderer
    renderer.close()


def borders() -> tuple[float, ...]:
    half = SCENE.cell_size / 2
    return place((half, half, half), RESOLUTION, 24).borders


def test_not_one_texel_differs_from_the_plain_loop(scene: PreparedScene, culled: Renderer) -> None:
    plain = PlainRenderer(scene)
    rng = np.random.default_rng(5)
    for face in range(6):
        eye = np.array(SCENE.first) + rng.uniform(-1, 1, 3) * SCENE.cell_size
        ours = culled.face(eye, face, borders(), RESOLUTION)
        for a, b in zip(ours, plain.face(eye, face, borders(), RESOLUTION), strict=True):
            np.testing.assert_array_equal(a, b)
        assert len(ours.texel) > 1000
    plain.close()


def test_pyrender_agrees_in_nearly_all_texels(scene: PreparedScene, culled: Renderer) -> None:
    pyrender = PyrenderRenderer(scene)
    eye = np.array(SCENE.first)
    for face in (0, 3, 5):
        a = culled.face(eye, face, borders(), RESOLUTION)
        b = pyrender.face(eye, face, borders(), RESOLUTION)
        key_a, key_b = (t.texel.astype(np.int64) * 1000 + t.layer for t in (a, b))
        _, in_a, in_b = np.intersect1d(key_a, key_b, return_indices=True)
        assert len(key_a) + len(key_b) - 2 * len(in_a) < 0.005 * len(key_a)
        difference = np.abs(a.color[in_a].astype(int) - b.color[in_b]).max(axis=1)
        assert (difference > 2).sum() < 0.01 * len(key_a)
    pyrender.close()
