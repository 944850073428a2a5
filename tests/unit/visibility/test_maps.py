"""Depth maps, their cache, and from-region visibility against plain drawing and plain loops."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import FACES, directions, project, texel_centres
from farfield_core.scene import PreparedScene
from farfield_worker.render.plain import PlainRenderer
from farfield_worker.slanted.tolerance import Tolerance
from farfield_worker.visibility.depth_maps import NEAREST, DepthMap, DepthMapRenderer, MapCache
from farfield_worker.visibility.from_region import cell_eyes, seen, triangles_seen
from farfield_worker.visibility.spread import STEP, spread
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.scenes import SceneWriter, random_scene

Floats = NDArray[np.float64]
RESOLUTION = 64


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize("seed", range(6))
def test_maps_show_what_a_picture_of_everything_shows(tmp_path: Path, seed: int) -> None:
    scene = random_scene(tmp_path / "prepared", seed, 2400, origin=(1000.0, 0.0, -2000.0))
    eye = scene.origin + np.array([0.31, 0.12, -0.77])
    maps = DepthMapRenderer(scene, RESOLUTION)
    for face in range(6):
        ours = maps.map(eye, face)
        oracle = maps.picture(eye, face, np.arange(scene.info.triangles, dtype=np.int32))
        # two rasterisers differ by a texel here and there along outlines
        same = np.abs(ours.disparity - oracle.disparity) <= 1e-4 * oracle.disparity
        assert same.mean() > 0.995
        # of two triangles at one depth either may win
        assert (ours.triangle == oracle.triangle).mean() > 0.98
    maps.close()


@pytest.mark.usefixtures("graphics")
def test_a_map_is_the_nearest_surface(tmp_path: Path) -> None:
    scene = random_scene(tmp_path / "prepared", 11)
    eye = scene.origin + np.array([0.3, 0.2, -0.7])
    maps, plain = DepthMapRenderer(scene, RESOLUTION), PlainRenderer(scene)
    everything = np.arange(scene.info.triangles, dtype=np.int32)
    for face in range(6):
        ours, picture = maps.map(eye, face), maps.picture(eye, face, everything)
        texels = plain.face(eye, face, [NEAREST], RESOLUTION)
        assert np.array_equal(np.flatnonzero(picture.disparity), texels.texel)
        colors = picture.color.reshape(-1)[texels.texel].view(np.uint8).reshape(-1, 4)
        assert (np.abs(colors.astype(int) - texels.color) <= 1).all(axis=1).mean() > 0.98
        shown = np.zeros(RESOLUTION**2)
        shown[texels.texel] = 1 / texels.depth
        same = np.abs(ours.disparity.reshape(-1) - shown) <= 1e-4 * shown
        assert same.mean() > 0.99
        # the triangle's own plane has that disparity there
        there = np.flatnonzero(ours.disparity)
        c = texel_centres(RESOLUTION)
        rays = directions(face, c[there % RESOLUTION], c[there // RESOLUTION])
        ids = ours.triangle.reshape(-1)[there]
        assert np.all(ids >= 0)
        assert np.all(ours.triangle.reshape(-1)[ours.disparity.reshape(-1) == 0] == -1)
        corners = scene.positions[scene.triangles[ids]].astype(float) + scene.origin - eye
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        plane = np.einsum("ij,ij->i", normal, corners[:, 0])
        d = np.einsum("ij,ij->i", normal, rays) / np.where(plane == 0, 1, plane)
        drawn = ours.disparity.reshape(-1)[there]
        assert np.mean(np.abs(d - drawn) <= 1e-3 * drawn) > 0.97
    maps.close()
    plain.close()


class Counting:
    """Maps that only remember having been asked for."""

    resolution = 4

    def __init__(self) -> None:
        self.asked: list[tuple[tuple[float, ...], int]] = []

    def map(self, eye: Floats, face: int) -> DepthMap:
        self.asked.append((tuple(eye), face))
        return DepthMap(np.zeros((4, 4), np.float32), np.zeros((4, 4), np.int32))


def test_neighbouring_cells_share_corner_maps() -> None:
    source = Counting()
    cache = MapCache(source, capacity=1000)
    half = np.array([5.0, 5.0, 5.0])
    first = cell_eyes(np.array([0.1, 0.2, 0.3]), half)
    second = cell_eyes(np.array([10.1, 0.2, 0.3]), half)
    for eye in first:
        cache.map(eye, 0)
    assert cache.made == 15
    for eye in second:
        cache.map(eye, 0)
    assert cache.made == 15 + 10  # four corners and the common face's middle are shared
    small = MapCache(source, capacity=2)
    for face in (0, 1, 2, 0, 2, 0):
        small.map(first[0], face)
    assert small.made == 4


class Walls:
    """Depth maps by casting rays at axis-parallel squares, the plainest way."""

    resolution = 32

    def __init__(self, squares: list[tuple[int, float, Floats]]) -> None:
        self.squares = squares  # axis, offset along it, (3, 2) bounds

    def map(self, eye: Floats, face: int) -> DepthMap:
        c = texel_centres(self.resolution)
        u, v = np.meshgrid(c, c)
        rays = directions(face, u, v)
        d = np.zeros(u.shape)
        for axis, offset, bounds in self.squares:
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (offset - eye[axis]) / rays[..., axis]
                hit = eye + t[..., None] * rays
                inside = np.all(
                    (np.delete(hit, axis, -1) >= np.delete(bounds, axis, 0)[:, 0])
                    & (np.delete(hit, axis, -1) <= np.delete(bounds, axis, 0)[:, 1]),
                    axis=-1,
                )
                d = np.where(inside & (t > 0), np.maximum(d, 1 / t), d)
        return DepthMap(d.astype(np.float32), np.zeros(d.shape, np.int32))


def test_seen_equals_a_plain_loop() -> None:
    rng = np.random.default_rng(3)
    squares = [
        (axis, float(rng.uniform(-40, 40)), np.sort(rng.uniform(-60, 60, (3, 2)), axis=1))
        for axis in rng.integers(0, 3, 12).tolist()
    ]
    maps = Walls(squares)
    points = rng.uniform(-80, 80, (600, 3))
    slack = rng.uniform(0, 2e-3, 600)
    eyes = cell_eyes(np.zeros(3), np.array([3.0, 2.0, 3.0]))
    want = np.zeros(600, bool)
    for eye in eyes:
        for face in range(6):
            near = maps.map(eye, face).disparity
            u, v, z = project(face, eye, points)
            for i in range(600):
                if z[i] > 0 and abs(u[i]) <= 1 and abs(v[i]) <= 1:
                    column, row = (min(int((t + 1) * 16), 31) for t in (u[i], v[i]))
                    around = near[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
                    want[i] |= around.min() <= 1 / z[i] + slack[i]
    got = seen(points, slack, eyes, maps)
    assert 0 < want.sum() < 600
    assert np.array_equal(got, want)
    known = rng.random(600) < 0.5
    assert np.array_equal(seen(points, slack, eyes, maps, known), want | known)


@pytest.mark.usefixtures("graphics")
def test_near_geometry_hides_what_is_behind(tmp_path: Path) -> None:
    scene = street(tmp_path / "prepared")
    maps = DepthMapRenderer(scene, RESOLUTION)
    eyes = cell_eyes(np.array([0.0, 2.0, 0.0]), np.array([1.0, 1.0, 1.0]))
    behind, beside = np.array([[0.0, 2.0, 60.0]]), np.array([[60.0, 2.0, 20.0]])
    slack = np.array([1e-4])
    assert not seen(behind, slack, eyes, maps)[0]
    assert seen(beside, slack, eyes, maps)[0]
    shown = triangles_seen(eyes, maps, scene.info.triangles)
    corners = scene.positions[scene.triangles[shown]]
    assert (corners[..., 2].mean(axis=1) > 50).sum() == 0
    assert (np.abs(corners[..., 2] - 6) < 1e-4).all(axis=1).sum() == 2
    maps.close()


def street(folder: Path) -> PreparedScene:
    """A wall before the eye and a box hidden behind it."""
    writer = SceneWriter()
    batch = writer.batch(double_sided=True)
    writer.quad(batch, [[-8, -8, 6], [8, -8, 6], [8, 12, 6], [-8, 12, 6]])
    writer.box(batch, [-3, 0, 60], [3, 5, 66])
    return writer.write(folder)


@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_spread_by_breadth_first_search(seed: int, steps: int) -> None:
    rng = np.random.default_rng(seed)
    size, n = 12, 120
    texel = np.sort(rng.integers(0, size * size, n)).astype(np.int32)
    d = rng.choice([0.01, 0.0102, 0.013, 0.02], n) + rng.uniform(0, 2e-4, n)
    start = rng.random(n) < 0.05
    tolerance = Tolerance.of(0, np.zeros(3), (5, 5, 5), 5e-3, 20.0)
    low, high = tolerance.interval(d, STEP)
    want = set(np.flatnonzero(start).tolist())
    for _ in range(steps):
        want |= {
            i
            for i in range(n)
            for j in want
            if abs(texel[i] % size - texel[j] % size) <= 1
            and abs(texel[i] // size - texel[j] // size) <= 1
            and low[i] <= d[j] <= high[i]
        }
    got = spread(texel, d, start, tolerance, size, steps)
    assert set(np.flatnonzero(got).tolist()) == want


def test_faces_are_numbered_as_in_the_format() -> None:
    # seen() finds a point's face from its largest coordinate
    for number, face in enumerate(FACES):
        axis = int(np.abs(face.forward).argmax())
        assert number == 2 * axis + (face.forward[axis] < 0)
