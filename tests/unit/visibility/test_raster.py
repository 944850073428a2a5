"""The processor's rasteriser against casting a ray through every texel at every triangle."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import FACES, directions, texel_centres
from farfield_worker.visibility.clusters import Clusters
from farfield_worker.visibility.raster import TILE, Tiles, hidden
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.scenes import SceneWriter

Floats = NDArray[np.float64]
RESOLUTION = 27  # not a whole number of tiles
NEAREST = 0.5


def cast(corners: Floats, double_sided: bool, face: int) -> tuple[Floats, Floats]:
    """Greatest disparity of triangles (n, 3, 3) by texel, and how far rays pass from any edge."""
    c = texel_centres(RESOLUTION)
    u, v = np.meshgrid(c, c)
    rays = directions(face, u, v)
    best, margin = np.zeros(u.shape), np.full(u.shape, np.inf)
    for p in corners:
        normal = np.cross(p[1] - p[0], p[2] - p[0])
        m = normal @ p[0]
        if m >= 0 and not double_sided:
            continue
        d = rays @ normal / m
        # signed volumes of the ray and each edge
        sides = np.stack([rays @ np.cross(p[i], p[(i + 1) % 3]) for i in range(3)]) * -np.sign(m)
        size = np.linalg.norm(p, axis=1).max()
        margin = np.minimum(margin, np.abs(sides).min(axis=0) / size**2)
        margin = np.minimum(margin, np.abs(d * NEAREST - 1))
        inside = (sides <= 0).all(axis=0) & (d > 0) & (d <= 1 / NEAREST)
        best = np.where(inside, np.maximum(best, d), best)
    return best, margin


@pytest.mark.parametrize("double_sided", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_raster_by_casting_rays(tmp_path: Path, seed: int, double_sided: bool) -> None:
    rng = np.random.default_rng(seed)
    writer = SceneWriter(origin=(50.0, 0.0, -80.0))
    batch = writer.batch(double_sided=double_sided)
    # small ones, large ones, and ones around the eye, which reach behind it
    for size, count in ((2.0, 300), (20.0, 20), (60.0, 4)):
        for _ in range(count):
            middle = rng.uniform(-30, 30, 3) if size < 60 else rng.uniform(-8, 8, 3)
            triangle = writer.origin + middle + rng.uniform(-size, size, (3, 3)) / 2
            writer.triangles(batch, triangle[None])
    scene = writer.write(tmp_path / "prepared")
    clusters = Clusters(scene)
    eye = scene.origin + np.array([0.3, 0.2, -0.1])
    relative = scene.positions[scene.triangles].astype(float) + scene.origin - eye
    for face in range(6):
        tiles = Tiles(RESOLUTION)
        view = clusters.in_view(eye, face, NEAREST, RESOLUTION)
        clusters.draw(view, eye, face, NEAREST, tiles)
        want, margin = cast(relative, double_sided, face)
        clear = margin > 1e-7
        assert clear.mean() > 0.9
        np.testing.assert_allclose(tiles.disparity[clear], want[clear], rtol=1e-5, atol=1e-9)
        assert np.array_equal(tiles.triangle >= 0, tiles.disparity > 0)
        forward = FACES[face].forward
        shown = tiles.triangle[tiles.triangle >= 0]
        assert np.all((relative[shown] @ forward).max(axis=1) >= NEAREST * (1 - 1e-9))


@given(st.integers(0, 2**32 - 1))
def test_hidden_is_the_least_of_the_tiles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tiles = Tiles(RESOLUTION)
    tiles.disparity[:] = rng.choice([0.5, 0.6, 0.7], tiles.disparity.shape, p=[0.001, 0.009, 0.99])
    tiles.stale[:] = True
    x0, y0 = rng.integers(0, RESOLUTION - 1, 2)
    x1, y1 = rng.integers((x0 + 1, y0 + 1), RESOLUTION + 1)
    rect = np.array([x0, y0, x1, y1], np.int32)
    nearest = float(rng.choice([0.45, 0.55, 0.65]))
    block = tiles.disparity[
        y0 // TILE * TILE : -(-y1 // TILE) * TILE, x0 // TILE * TILE : -(-x1 // TILE) * TILE
    ]
    got = hidden(rect, nearest, tiles.disparity, tiles.floor, tiles.stale)
    assert got == (block.min() > nearest)
