"""Texels of a face against rays cast on the CPU: coverage, layer, depth and colour."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import directions
from farfield_core.placement import place
from farfield_worker.render.culled import CulledRenderer

from tests.unit.raycast import JITTER, cast, stable
from tests.unit.scenes import SceneWriter

pytestmark = pytest.mark.usefixtures("graphics")

RESOLUTION = 24


def make_scene(folder: Path, seed: int):
    """Triangles of all untextured kinds around the origin, one colour each."""
    rng = np.random.default_rng(seed)
    writer = SceneWriter((50.0, 3.0, 0.0))
    for batch in (
        writer.batch(),
        writer.batch(double_sided=True, emissive=(0.05, 0.0, 0.1)),
        writer.batch(unlit=True, double_sided=True),
        writer.batch(alpha="mask", cutoff=0.5, double_sided=True),
        writer.batch(alpha="dither", double_sided=True),
    ):
        centre = rng.normal(size=(30, 1, 3))
        centre *= np.exp(rng.uniform(1.5, 5.0, (30, 1, 1))) / np.abs(centre).max(-1, keepdims=True)
        corners = centre + 0.4 * np.abs(centre).max(-1, keepdims=True) * rng.normal(size=(30, 3, 3))
        color = np.repeat(rng.uniform(0.1, 1.0, (30, 1, 4)), 3, axis=1)
        writer.triangles(batch, corners + writer.origin, color=color)
    return writer.write(folder / "prepared", block_triangles=20)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("face", range(6))
def test_texels_match_rays(tmp_path, seed, face):
    scene = make_scene(tmp_path, seed)
    eye = scene.origin + np.array([0.2, -0.1, 0.3])
    borders = place((2.0, 2.0, 2.0), RESOLUTION, 6).borders
    texel = np.arange(RESOLUTION**2)
    pixels = np.stack([texel % RESOLUTION, texel // RESOLUTION], axis=1)
    renderer = CulledRenderer(scene)
    texels = renderer.face(eye, face, borders, RESOLUTION)
    renderer.close()

    casts = []
    for dx, dy in JITTER:
        u = (2 * (pixels[:, 0] + dx) + 1) / RESOLUTION - 1
        v = (2 * (pixels[:, 1] + dy) + 1) / RESOLUTION - 1
        casts.append(cast(scene, eye, directions(face, u, v), pixels))
    limits = [np.inf, *borders]
    compared = 0
    for layer in range(len(borders)):
        answers = []
        for hits in casts:
            inside = (hits.distance >= limits[layer + 1]) & (hits.distance < limits[layer])
            answers.append(np.where(inside, hits.distance, np.inf).min(axis=1))
        rows = texels.layer == layer
        depth = np.full(RESOLUTION**2, np.inf)
        depth[texels.texel[rows]] = texels.depth[rows]
        sure = stable(answers)
        np.testing.assert_array_equal(np.isinf(depth[sure]), np.isinf(answers[0][sure]))
        drawn = sure & np.isfinite(depth)
        np.testing.assert_allclose(depth[drawn], answers[0][drawn], rtol=2e-5)
        color = np.zeros((RESOLUTION**2, 4), np.uint8)
        color[texels.texel[rows]] = texels.color[rows]
        distance = casts[0].distance
        inside = (distance >= limits[layer + 1]) & (distance < limits[layer])
        nearest = np.where(inside, distance, np.inf).argmin(axis=1)
        expected = casts[0].color[np.arange(len(texel)), nearest]
        difference = color[drawn, :3].astype(int) - expected[drawn].astype(int)
        assert np.abs(difference).max(initial=0) <= 1
        assert (color[drawn, 3] == 255).all()
        compared += int(drawn.sum())
        assert sure.mean() > 0.6
    assert compared > 100
