"""pyrender against the culled renderer: other clipping and depth, otherwise the same texels."""

import numpy as np
import pytest
from farfield_core.placement import place
from farfield_worker.gl import context as gl
from farfield_worker.render import open_renderer
from farfield_worker.render.culled import CulledRenderer

from tests.unit.scenes import SceneWriter, random_scene

pytestmark = pytest.mark.usefixtures("graphics")


@pytest.mark.parametrize("seed", [0, 1])
def test_nearly_all_texels_agree(tmp_path, seed):
    resolution = 96
    scene = random_scene(tmp_path / "prepared", seed, origin=(10.0, 0.0, -20.0))
    borders = place((2.0, 2.0, 2.0), resolution, 20).borders
    culled, pyrender = open_renderer("moderngl", scene), open_renderer("pyrender", scene)
    assert isinstance(culled, CulledRenderer)
    assert pyrender.name.startswith("pyrender on ")
    total = lonely = recolored = 0
    eye = scene.origin + np.array([0.3, 0.1, 0.7])
    for face in range(6):
        a = culled.face(eye, face, borders, resolution)
        b = pyrender.face(eye, face, borders, resolution)
        assert (np.diff(b.texel.astype(np.int64) * 1000 + b.layer) > 0).all()
        assert (b.color[:, 3] == 255).all()
        key_a, key_b = (t.texel.astype(np.int64) * 1000 + t.layer for t in (a, b))
        _, in_a, in_b = np.intersect1d(key_a, key_b, return_indices=True)
        total += len(key_a)
        lonely += len(key_a) + len(key_b) - 2 * len(in_a)
        # both know 24 bits of 1 / Z between a layer's borders
        agree = np.isclose(a.depth[in_a], b.depth[in_b], rtol=1e-4)
        difference = np.abs(a.color[in_a].astype(int) - b.color[in_b].astype(int)).max(axis=1)
        recolored += int(((difference > 2) | ~agree).sum())
    culled.close()
    pyrender.close()
    assert total > 15_000
    # measured: 0.05 % lonely where a border cuts a surface, 0.1 % recoloured where uvs are steep
    assert lonely < 0.002 * total
    assert recolored < 0.005 * total


def test_it_leaves_the_shared_context_as_it_was(tmp_path):
    writer = SceneWriter()
    writer.box(writer.batch(), (-1, -1, -9), (1, 1, -7))
    scene = writer.write(tmp_path / "prepared")
    culled = open_renderer("moderngl", scene)
    eye, borders = np.zeros(3), (20.0, 5.0)
    before = culled.face(eye, 5, borders, 32)
    pyrender = open_renderer("pyrender", scene)
    assert len(pyrender.face(eye, 5, borders, 32).texel) == len(before.texel) > 0
    after = culled.face(eye, 5, borders, 32)
    pyrender.close()
    again = culled.face(eye, 5, borders, 32)
    culled.close()
    for other in (after, again):
        for a, b in zip(before, other, strict=True):
            np.testing.assert_array_equal(a, b)
    with gl.current() as context:
        assert context.error == "GL_NO_ERROR"


def test_a_border_through_a_wall_splits_it_between_layers(tmp_path):
    writer = SceneWriter()
    floor = np.array([[-40, -2, -1], [40, -2, -1], [40, -2, -60], [-40, -2, -60]], np.float64)
    writer.quad(writer.batch(), floor)
    scene = writer.write(tmp_path / "prepared")
    pyrender = open_renderer("pyrender", scene)
    texels = pyrender.face(np.zeros(3), 5, (20.0, 8.0, 5.0), 64)
    pyrender.close()
    assert set(texels.layer.tolist()) == {0, 1, 2}
    low, high = np.array([20.0, 8.0, 5.0])[texels.layer], np.array([60.1, 20.0, 8.0])[texels.layer]
    assert ((texels.depth >= low * 0.9999) & (texels.depth <= high * 1.0001)).all()
