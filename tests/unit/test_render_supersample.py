"""Supersampled texels against the same rule written plainly."""

import farfield_shading as shading
import numpy as np
import pytest
from farfield_core.placement import place
from farfield_worker.render import open_renderer
from farfield_worker.render.interface import FaceTexels
from farfield_worker.render.supersample import average
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.scenes import SceneWriter


def random_samples(seed: int, fine: int, layers: int, density: float) -> FaceTexels:
    rng = np.random.default_rng(seed)
    texel, layer = np.nonzero(rng.random((fine * fine, layers)) < density)
    color = rng.integers(0, 256, (len(texel), 4), np.uint8)
    color[:, 3] = 255
    depth = rng.uniform(1.0, 100.0, len(texel)).astype(np.float32)
    return FaceTexels(texel.astype(np.int32), layer.astype(np.int16), color, depth)


def plainly(samples: FaceTexels, resolution: int, factor: int, layers: int):
    """Dense arrays (texels, layers): covered, linear colour, depth."""
    fine = resolution * factor
    row, column = np.divmod(samples.texel, fine)
    texel = row // factor * resolution + column // factor
    shape = (resolution * resolution, layers)
    own, light, disparity = np.zeros(shape), np.zeros((*shape, 3)), np.zeros(shape)
    np.add.at(own, (texel, samples.layer), 1)
    linear = shading.to_linear(samples.color[:, :3] / 255)
    np.add.at(light, (texel, samples.layer), linear)
    np.add.at(disparity, (texel, samples.layer), 1.0 / samples.depth)
    padded = np.pad(own, ((0, 0), (1, 1)))
    around = padded[:, :-2] + own + padded[:, 2:]
    covered = (around >= factor**2 / 2) & (own >= factor**2 / 4)
    with np.errstate(divide="ignore", invalid="ignore"):
        return covered, light / own[..., None], own / disparity


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    factor=st.integers(2, 4),
    layers=st.integers(1, 6),
    density=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
)
def test_average_follows_the_rule(seed, factor, layers, density):
    resolution = 5
    samples = random_samples(seed, resolution * factor, layers, density)
    texels = average(samples, resolution, factor)
    covered, light, depth = plainly(samples, resolution, factor, layers)
    np.testing.assert_array_equal(np.stack([texels.texel, texels.layer]), np.nonzero(covered))
    np.testing.assert_allclose(texels.depth, depth[covered], rtol=1e-5)
    expected = shading.to_srgb(light[covered]) * 255
    assert np.abs(texels.color[:, :3] - expected).max(initial=0) <= 0.501
    assert (texels.color[:, 3] == 255).all()
    assert [a.dtype for a in texels] == [np.int32, np.int16, np.uint8, np.float32]


@pytest.mark.usefixtures("graphics")
def test_a_floor_across_borders_has_no_cracks_and_keeps_its_outline(tmp_path):
    writer = SceneWriter()
    floor = np.array([[-30, -2, -2], [30, -2, -2], [30, -2, -300], [-30, -2, -300]], np.float64)
    writer.quad(writer.batch(), floor)
    scene = writer.write(tmp_path / "prepared")
    borders = place((2.0, 2.0, 2.0), 64, 20).borders
    covered = {}
    for supersample in (1, 2, 3):
        renderer = open_renderer("moderngl", scene, supersample)
        texels = renderer.face(np.zeros(3), 5, borders, 64)
        renderer.close()
        covered[supersample] = np.zeros(64 * 64, np.bool_)
        covered[supersample][texels.texel] = True
    for supersample in (2, 3):
        # only the outline may move, and by less than a texel
        differs = (covered[1] != covered[supersample]).reshape(64, 64)
        assert differs.sum() < 70
        inner = covered[1].reshape(64, 64)
        inner = inner[1:-1, 1:-1] & inner[:-2, 1:-1] & inner[2:, 1:-1]
        inner &= covered[1].reshape(64, 64)[1:-1, :-2] & covered[1].reshape(64, 64)[1:-1, 2:]
        assert not (differs[1:-1, 1:-1] & inner).any()
