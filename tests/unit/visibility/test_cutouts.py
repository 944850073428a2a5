"""Opacities against plain loops over wrapped texels and Pillow's averages."""

from itertools import pairwise
from pathlib import Path

import farfield_shading
import numpy as np
import pytest
from farfield_worker.visibility.cutouts import Cutouts, dithered, mipmaps, opacity
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.scenes import SceneWriter, random_scene


def test_mipmaps_are_means() -> None:
    image = np.random.default_rng(0).integers(0, 256, (8, 4), np.uint8)
    levels = mipmaps(image)
    assert [level.shape for level in levels] == [(8, 4), (4, 2), (2, 1), (1, 1)]
    for fine, coarse in pairwise(levels):
        sy, sx = fine.shape[0] // coarse.shape[0], fine.shape[1] // coarse.shape[1]
        means = fine.reshape(coarse.shape[0], sy, coarse.shape[1], sx).mean(axis=(1, 3))
        assert np.all(np.abs(coarse - means) <= 0.5)


def texel_of(i: int, n: int, how: str) -> int:
    """A texel's index by walking there step by step."""
    if how == "clamp":
        return min(max(i, 0), n - 1)
    tile = list(range(n)) if how == "repeat" else [*range(n), *reversed(range(n))]
    return tile[i - len(tile) * int(np.floor(i / len(tile)))]


@pytest.mark.parametrize(("wrap_u", "wrap_v"), [("repeat", "mirror"), ("clamp", "repeat")])
def test_opacity_by_loops(tmp_path: Path, wrap_u: str, wrap_v: str) -> None:
    rng = np.random.default_rng(1)
    pixels = rng.integers(0, 256, (8, 16, 4), np.uint8)
    writer = SceneWriter()
    texture = writer.texture(pixels, wrap_u=wrap_u, wrap_v=wrap_v)
    batch = writer.batch(texture=texture, alpha="mask")
    writer.quad(batch, np.array([[0, 0, 9], [1, 0, 9], [1, 1, 9], [0, 1, 9]]))
    cutouts = Cutouts.of(writer.write(tmp_path / "prepared"))
    levels = mipmaps(pixels[..., 3])
    for u, v, lod in rng.uniform((-2, -2, -1), (3, 3, 6), (200, 3)).tolist():
        clamped = min(max(lod, 0.0), len(levels) - 1.0)
        want = 0.0
        for level, image in enumerate(levels):
            if abs(clamped - level) >= 1:
                continue
            h, w = image.shape
            x, y = u * w - 0.5, v * h - 0.5
            value = sum(
                max(0.0, 1 - abs(x - i))
                * max(0.0, 1 - abs(y - j))
                * float(image[texel_of(j, h, wrap_v), texel_of(i, w, wrap_u)])
                for i in range(int(np.floor(x)), int(np.floor(x)) + 2)
                for j in range(int(np.floor(y)), int(np.floor(y)) + 2)
            )
            want += value * (1 - abs(clamped - level))
        assert opacity(cutouts, 0, u, v, lod) == pytest.approx(want / 255, abs=1e-9)


@given(st.floats(0, 1), st.integers(0, 63), st.integers(0, 63))
def test_dither_is_that_of_the_light_model(alpha: float, column: int, row: int) -> None:
    assert "bool ff_dither(float alpha, vec2 pixel)" in farfield_shading.glsl()
    # of each 4 x 4 texels as many are drawn as the opacity says
    base = [(x, y) for y in range(4) for x in range(4)]
    drawn = sum(bool(dithered(alpha, x, y)) for x, y in base)
    assert abs(drawn - 16 * alpha) <= 0.5 + 1e-9
    assert dithered(alpha, column, row) == dithered(alpha, column % 4, row % 4)


def test_scenes_without_holes_have_no_textures(tmp_path: Path) -> None:
    writer = SceneWriter()
    writer.box(writer.batch(), (0, 0, 5), (1, 1, 6))
    cutouts = Cutouts.of(writer.write(tmp_path / "prepared"))
    assert cutouts.kind.tolist() == [0]
    assert cutouts.texture.tolist() == [-1]
    mixed = Cutouts.of(random_scene(tmp_path / "mixed", 0, 60))
    assert set(mixed.kind.tolist()) == {0, 1, 2}
    assert mixed.texture[mixed.kind == 1].min() >= 0
