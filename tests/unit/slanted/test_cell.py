"""A whole cell: what is promised of its quads, by brute force, and residual quads."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import FACES, directions, project, texel_centres
from farfield_core.placement import default_alpha
from farfield_core.scene import PreparedScene
from farfield_worker.slanted.baker import SlantedBaker, SlantedCell, SlantedSettings
from farfield_worker.slanted.painter import QuadPainter
from farfield_worker.slanted.quads import limit_corners
from farfield_worker.slanted.residual import (
    CROWD,
    corners,
    far_texels,
    residual_texels,
)
from farfield_worker.slanted.segment import SegmentSettings
from farfield_worker.slanted.tolerance import Tolerance
from farfield_worker.visibility.depth_maps import DepthMap
from numpy.typing import NDArray

from tests.unit.scenes import SceneWriter, random_scene
from tests.unit.slanted.promises import check_angles, check_order, check_tolerances

Floats = NDArray[np.float64]
RESOLUTION = 64
HALF = (2.0, 1.5, 2.5)
SETTINGS = SlantedSettings(HALF, 8.0, default_alpha(RESOLUTION), RESOLUTION)


def town(folder: Path) -> PreparedScene:
    """A street of boxes on a floor, some of them high, one right beside the cell."""
    writer = SceneWriter(origin=(300.0, 0.0, -100.0))
    batch = writer.batch(double_sided=True)
    rng = np.random.default_rng(5)
    o = writer.origin
    floor = np.array([[-200, -2, 200], [200, -2, 200], [200, -2, -200], [-200, -2, -200]])
    writer.quad(batch, o + floor, color=(0.4, 0.5, 0.2, 1))
    for x in range(-60, 61, 15):
        for z in range(-60, 61, 15):
            if (x, z) != (0, 0):
                low = o + np.array([x + rng.uniform(-3, 3), -2, z + rng.uniform(-3, 3)])
                size = rng.uniform((3, 3, 3), (8, 14, 8))
                writer.box(batch, low, low + size, color=(*rng.uniform(0.1, 1, 3), 1))
    return writer.write(folder)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> tuple[PreparedScene, SlantedCell]:
    scene = town(tmp_path_factory.mktemp("town") / "prepared")
    baker = SlantedBaker(scene, RESOLUTION)
    cell = baker.cell(scene.origin, SETTINGS)
    baker.close()
    return scene, cell


def test_promises(baked: tuple[PreparedScene, SlantedCell]) -> None:
    _, cell = baked
    assert {bool(part.eye.any()) for part in cell.parts} == {False, True}
    check_tolerances(cell, SETTINGS)
    check_angles(cell, SETTINGS, every=7)
    check_order(cell, SETTINGS)


def test_quads_fit_the_format(baked: tuple[PreparedScene, SlantedCell]) -> None:
    _, cell = baked
    for part in cell.parts:
        for polygon, plane, sheet in zip(
            part.quads.polygons, part.quads.plane, part.quads.sheet, strict=True
        ):
            assert 3 <= len(polygon) <= 8
            line = np.array([plane[0], plane[1], plane[2] - plane[0] - plane[1]])
            d = polygon @ (2 * line[:2] / RESOLUTION) + line[2]
            assert np.all(d >= -1e-12)
            edges = np.roll(polygon, -1, axis=0) - polygon
            turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
            assert np.all(turns >= -1e-9)
            x0, y0, x1, y1 = part.quads.texels.rect[sheet]
            assert np.all(polygon >= np.array([x0, y0]) - 0.05 - 1e-9)
            assert np.all(polygon <= np.array([x1, y1]) + 0.05 + 1e-9)
            # nothing of it lies in the near field
            middle = np.vstack([polygon, polygon.mean(axis=0)])
            u, v = (2 * middle / RESOLUTION - 1).T
            where = (
                part.eye
                + directions(part.face, u, v)
                / np.maximum(plane[0] * u + plane[1] * v + plane[2], 1e-9)[:, None]
            )
            assert np.all(np.abs(where).max(axis=1) >= SETTINGS.near * (1 - 1e-6))


def test_the_painter_draws_what_rays_meet(baked: tuple[PreparedScene, SlantedCell]) -> None:
    _, cell = baked
    painter = QuadPainter(RESOLUTION)
    for part in cell.parts:
        painter.add(part.face, part.eye, part.quads)
    eye, face = np.array([1.0, 0.7, -1.2]), 4
    shown, color = painter.picture(face, eye)
    painter.close()
    c = texel_centres(RESOLUTION)
    u, v = np.meshgrid(c, c)
    rays = directions(face, u, v)
    want, want_color = np.zeros(u.shape), np.zeros(u.shape, np.uint32)
    for part in cell.parts:
        axes = FACES[part.face]
        for polygon, plane, sheet in zip(
            part.quads.polygons, part.quads.plane, part.quads.sheet, strict=True
        ):
            # p on the plane: n . (p - e) = 1 with n = a right + b down + c forward
            n = plane[0] * axes.right + plane[1] * axes.down + plane[2] * axes.forward
            denominator = 1 - n @ (eye - part.eye)
            d = rays @ n / denominator if abs(denominator) > 1e-12 else np.zeros(u.shape)
            # quads are seen from their own eye's side of the plane only
            ahead = (d > 0) & (denominator > 0)
            p = eye + rays / np.where(ahead, d, 1)[..., None]
            pu, pv, z = project(part.face, part.eye, p)
            xy = (np.stack([pu, pv], axis=-1) + 1) * RESOLUTION / 2
            inside = ahead & (z > 0)
            for i in range(len(polygon)):
                edge = polygon[(i + 1) % len(polygon)] - polygon[i]
                with np.errstate(invalid="ignore"):
                    inside &= (xy - polygon[i]) @ np.array([-edge[1], edge[0]]) >= 0
            image = part.quads.images[sheet].view(np.uint32)[..., 0]
            x0, y0, x1, y1 = part.quads.texels.rect[sheet]
            column = np.clip(np.floor(np.where(inside, xy[..., 0], x0)).astype(int), x0, x1 - 1)
            row = np.clip(np.floor(np.where(inside, xy[..., 1], y0)).astype(int), y0, y1 - 1)
            texel = image[row - y0, column - x0]
            nearer = inside & (texel != 0) & (d > want)
            want[nearer], want_color[nearer] = d[nearer], texel[nearer]
    assert (want > 0).sum() > 300
    # rays that graze an edge or a texel's border may round either way
    assert (((shown > 0) == (want > 0)).mean()) > 0.995
    both = (shown > 0) & (want > 0)
    assert (np.abs(shown[both] - want[both]) <= 1e-3 * want[both]).mean() > 0.98
    assert (color[both] == want_color[both]).mean() > 0.97


def test_residual_texels_by_loops() -> None:
    rng = np.random.default_rng(4)
    size = 24
    truth = np.where(rng.random((size, size)) < 0.85, rng.choice([0.02, 0.05], (size, size)), 0)
    shown = np.where(rng.random((size, size)) < 0.6, truth, rng.choice([0, 0.015], (size, size)))
    far = (truth > 0) & (rng.random((size, size)) < 0.9)
    tolerance = Tolerance.of(4, np.array([2.0, 1.5, 2.5]), HALF, 5e-3, 8.0)
    depth_map = DepthMap(truth.astype(np.float32), np.zeros((size, size), np.int32))
    got = residual_texels(depth_map, shown.astype(np.float32), tolerance, far)

    def around(y: int, x: int) -> list[tuple[int, int]]:
        rows, columns = (range(k - 1, k + 2) for k in (y, x))
        return [(min(max(r, 0), size - 1), min(max(c, 0), size - 1)) for r in rows for c in columns]

    missing = np.zeros((size, size), bool)
    for y in range(size):
        for x in range(size):
            if not far[y, x]:
                continue
            true = [depth_map.disparity[p] for p in around(y, x)]
            if shown[y, x] == 0:
                missing[y, x] = min(true) > 0
            elif min(true) > 0:
                lows = tolerance.interval(np.array(true, np.float32))[0]
                missing[y, x] = np.float32(shown[y, x]) < lows.min()
    crowded = np.array(
        [
            [missing[y, x] and sum(missing[p] for p in around(y, x)) >= CROWD for x in range(size)]
            for y in range(size)
        ]
    )
    want = np.array(
        [[any(crowded[p] for p in around(y, x)) for x in range(size)] for y in range(size)]
    )
    assert 0 < crowded.sum() < missing.sum()
    assert np.array_equal(got, want)


def test_corners_start_with_a_tetrahedron_that_neighbours_share() -> None:
    half = np.array([2.0, 1.0, 3.0])
    middle = np.array([0.3, 10.2, -7.1])
    for axis in range(3):
        both = []
        for step in (0.0, 2.0):
            centre = middle + step * half * np.eye(3)[axis]
            found = corners(centre, half)
            assert len({tuple(c) for c in found}) == 8
            assert (np.abs(found) == half).all()
            first = found[:4]
            edges = np.linalg.norm((first[:, None] - first[None]) / half, axis=2)
            assert np.allclose(edges[~np.eye(4, dtype=bool)], 8**0.5), "no two lie on an edge"
            both.append({tuple(np.round(centre + c, 6)) for c in first})
        assert len(both[0] & both[1]) == 2


@pytest.mark.usefixtures("graphics")
def test_residual_quads_show_what_the_centre_sees_edge_on(tmp_path: Path) -> None:
    writer = SceneWriter()
    batch = writer.batch(double_sided=True)
    # a wall along a ray from the centre, which sees nothing of it, before a backdrop
    wall = np.array([[0, -4, 20], [0, -4, 40], [0, 4, 40], [0, 4, 20]], float)
    writer.quad(batch, wall, color=(1, 0, 0, 1))
    writer.quad(batch, np.array([[-90, -90, 60], [90, -90, 60], [90, 90, 60], [-90, 90, 60]]))
    scene = writer.write(tmp_path / "prepared")
    fine = 4 * RESOLUTION
    baker = SlantedBaker(scene, fine)
    eye = np.array([-1.4, 0.3, -1.0])  # quads have one colour on both sides
    everything = np.arange(scene.info.triangles, dtype=np.int32)
    truth = baker.renderer.picture(eye, 4, everything)
    far = far_texels(baker.maps.map(eye, 4), 4, eye, SETTINGS.near)
    red = far & (truth.disparity > 0) & (truth.color & 0xFF00 == 0)
    assert red.sum() > 100
    shares = {}
    for residual in (False, True):
        settings = SlantedSettings(HALF, 8.0, SETTINGS.alpha, fine, faces=(4,), residual=residual)
        cell = baker.cell((0.0, 0.0, 0.0), settings)
        painter = QuadPainter(fine)
        for part in cell.parts:
            painter.add(part.face, part.eye, part.quads)
        _, color = painter.picture(4, eye)
        painter.close()
        shares[residual] = (color[red] == truth.color[red]).mean()
    baker.close()
    assert shares[False] < 0.1
    assert shares[True] > 0.6  # the rest lies within a texel of the wall's outline


@pytest.mark.usefixtures("graphics")
def test_without_visibility_everything_is_kept(tmp_path: Path) -> None:
    scene = random_scene(tmp_path / "prepared", 3, 300)
    baker = SlantedBaker(scene, RESOLUTION)
    settings = SlantedSettings(
        HALF, 8.0, SETTINGS.alpha, RESOLUTION, visibility=False, residual=False
    )
    cell = baker.cell(scene.origin, settings)
    assert cell.seen == cell.fragments > 0
    less = baker.cell(
        scene.origin, SlantedSettings(HALF, 8.0, SETTINGS.alpha, RESOLUTION, residual=False)
    )
    assert less.seen < less.fragments == cell.fragments
    coarse = baker.cell(
        scene.origin,
        SlantedSettings(
            HALF, 8.0, SETTINGS.alpha, RESOLUTION, residual=False, segment=SegmentSettings(fill=0.9)
        ),
    )
    assert sum(len(p.quads.sheet) for p in coarse.parts) > sum(
        len(p.quads.sheet) for p in less.parts
    )
    baker.close()


def test_polygons_of_many_corners_are_cut() -> None:
    angle = np.linspace(0, 2 * np.pi, 13)[:-1]
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    parts = limit_corners(circle)

    def area(p: Floats) -> float:
        x, y = p.T
        return float(abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2)

    assert all(3 <= len(p) <= 8 for p in parts)
    assert sum(area(p) for p in parts) == pytest.approx(area(circle))
    assert len(limit_corners(circle[:8])) == 1
