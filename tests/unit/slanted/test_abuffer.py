"""The A-buffer against layers drawn one by one, and its sorting."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import directions, texel_centres
from farfield_core.placement import place
from farfield_worker.render.plain import PlainRenderer
from farfield_worker.slanted.abuffer import ABuffer
from farfield_worker.slanted.fragments import Fragments, sort_fragments
from farfield_worker.slanted.near_border import inside, walls
from farfield_worker.slanted.planes import seeds
from farfield_worker.slanted.quads import texel_points, texel_uv
from farfield_worker.visibility.clusters import ByBatch, Clusters, InView
from numpy.typing import NDArray

from tests.unit.scenes import SceneWriter, random_scene

Floats = NDArray[np.float64]
RESOLUTION = 64


class AllClusters(Clusters):
    """Drops nothing."""

    def in_view(self, eye: Floats, face: int, nearest: float, resolution: int) -> InView:
        n = len(self.runs)
        rect = np.tile(np.array([0, 0, resolution, resolution], np.int32), (n, 1))
        triangles = self.runs[:, 2].astype(np.int32)
        return InView(np.arange(n, dtype=np.int32), triangles, rect, np.full(n, 1e9, np.float32))

    def triangles(
        self, clusters: InView, eye: Floats, face: int, nearest: float, resolution: int
    ) -> ByBatch:
        return self.by_batch(np.arange(self.runs[:, 2].sum(), dtype=np.int32))


def test_sorting_is_by_texel_then_depth_then_row() -> None:
    rng = np.random.default_rng(2)
    n = 4000
    d = rng.choice(rng.uniform(0.001, 0.05, 40), n).astype(np.float32)
    texel, row = rng.integers(0, 64, n), rng.integers(0, 500, n)
    records = np.stack([texel, d.view(np.uint32), rng.integers(0, 2**32, n), row], axis=1)
    triangles = rng.integers(0, 10**6, 500).astype(np.int32)
    got = sort_fragments(records.astype(np.uint32), triangles, 8)
    order = np.lexsort((row, -d, texel))
    assert np.array_equal(got.texel, texel[order])
    assert np.array_equal(got.disparity, d[order])
    assert np.array_equal(got.triangle, triangles[row[order]])


def outside(fragments: Fragments, face: int, near: float) -> Fragments:
    u, v = texel_uv(fragments.texel, RESOLUTION)
    planes = walls(face, np.zeros(3), near)
    return fragments.take(~inside(fragments.disparity.astype(float), u, v, planes))


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize("seed", range(4))
def test_every_layer_of_the_plain_renderer_is_in_it(tmp_path: Path, seed: int) -> None:
    scene = random_scene(tmp_path / "prepared", seed, 800, origin=(50.0, 0.0, 20.0))
    eye = scene.origin + np.array([0.31, 0.12, -0.77])
    borders = place((2.0, 2.0, 2.0), RESOLUTION, 12).borders
    abuffer, plain = ABuffer(scene), PlainRenderer(scene)
    for face in range(6):
        ours = outside(abuffer.fragments(eye, face, borders[-1], RESOLUTION), face, borders[-1])
        layers = plain.face(eye, face, borders, RESOLUTION)
        edges = (1 / np.array([np.inf, *borders])).astype(np.float32)
        layer = np.searchsorted(edges, ours.disparity, side="left") - 1
        # the nearest fragment of each texel and layer is what the plain renderer shows
        key = ours.texel.astype(np.int64) * 100 + layer
        first = np.unique(key, return_index=True)[1]
        want = layers.texel.astype(np.int64) * 100 + layers.layer
        assert np.array_equal(key[first], want)
        # layers come from window depths and another near clip plane, so slivers round differently
        off = np.abs(1 / ours.disparity[first] / layers.depth - 1)
        assert (off <= 1e-5).mean() > 0.99
        assert np.all(off <= 1e-3)
        same = ours.color[first].view(np.uint8).reshape(-1, 4) == layers.color
        assert same.all(axis=1).mean() > 0.999  # of two surfaces at one depth either may win
    abuffer.close()
    plain.close()


@pytest.mark.usefixtures("graphics")
def test_small_buffers_and_culling_change_nothing(tmp_path: Path) -> None:
    scene = random_scene(tmp_path / "prepared", 7, 1200)
    eye = scene.origin + np.array([0.31, 0.12, -0.77])
    plenty, small = ABuffer(scene), ABuffer(scene, capacity=3000)
    everything = ABuffer(scene, AllClusters(scene))
    for face in range(6):
        want = everything.fragments(eye, face, 6.0, RESOLUTION)
        assert len(want.texel) > 0
        for other in (plenty, small):
            got = other.fragments(eye, face, 6.0, RESOLUTION)
            assert np.array_equal(got.texel, want.texel)
            assert np.array_equal(got.disparity, want.disparity)
    for thing in (plenty, small, everything):
        thing.close()


@pytest.mark.usefixtures("graphics")
def test_the_near_border_is_the_cube_around_the_centre(tmp_path: Path) -> None:
    writer = SceneWriter()
    batch = writer.batch(double_sided=True)
    floor = np.array([[-90, -3, 90], [90, -3, 90], [90, -3, -90], [-90, -3, -90]])
    for height in (0, 9):
        writer.quad(batch, floor + np.array([0, height, 0]))
    for x in (-14, 11):
        for z in (-60, -8, 8, 31):
            writer.box(batch, [x, -3, z], [x + 4, 8, z + 9])
    scene = writer.write(tmp_path / "prepared")
    centre, offset = scene.origin + np.array([0.3, 0.1, -0.7]), np.array([2.0, -2.0, 2.0])
    near = 9.0
    abuffer = ABuffer(scene)
    total = 0
    for face in range(6):
        ours = abuffer.fragments(centre + offset, face, near, RESOLUTION, centre)
        points = offset + texel_points(face, ours.texel, ours.disparity, RESOLUTION)
        u, v = texel_uv(ours.texel, RESOLUTION)
        within = inside(ours.disparity.astype(float), u, v, walls(face, offset, near))
        assert np.array_equal(within, np.abs(points).max(axis=1) < near)
        assert within.sum() <= 0.5 * len(within)
        total += within.sum()
        # what is inside lies at most two texels past the border, on its triangle's plane
        row, planes = seeds(scene, centre + offset, face, ours.triangle)
        plane = planes.plane[row[within]]
        steps = 2 / RESOLUTION * np.array([(x, y) for x in range(-2, 3) for y in range(-2, 3)])
        crossed = np.zeros(within.sum(), bool)
        for du, dv in steps:
            uu, vv = u[within] + du, v[within] + dv
            d = plane[:, 0] * uu + plane[:, 1] * vv + plane[:, 2]
            crossed |= ~inside(d, uu, vv, walls(face, offset, near) * (1 + 1e-3))
        assert np.all(crossed)
    assert total > 0
    abuffer.close()


def test_texel_points_lie_on_their_rays() -> None:
    texel = np.array([0, 63, 64 * 64 - 1], np.int32)
    points = texel_points(5, texel, np.array([0.1, 0.2, 0.5]), RESOLUTION)
    c = texel_centres(RESOLUTION)
    np.testing.assert_allclose(points[1], directions(5, c[63], c[0]) / 0.2)
