"""A picture of a scene against rays cast on the CPU."""

from pathlib import Path

import farfield_shading as shading
import numpy as np
import pytest
from farfield_core.errors import BadInputError
from farfield_worker.prepare import prepare
from farfield_worker.shoot.command import shoot_to_file
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import NearField, View
from PIL import Image

from tests.unit.raycast import JITTER, cast, stable
from tests.unit.scenes import SceneWriter
from tests.unit.test_render_raycast import make_scene

pytestmark = pytest.mark.usefixtures("graphics")

VIEWS = [(0.0, 0.0, 60.0), (2.1, 0.4, 90.0), (-0.7, -1.2, 40.0), (3.1, 1.5, 120.0)]


def rays(view: View, dx: float = 0.0, dy: float = 0.0):
    """Directions through a view's pixels, (size^2, 3), of length 1 along the camera's axis."""
    row, column = np.divmod(np.arange(view.size**2), view.size)
    tangent = np.tan(np.radians(view.fov) / 2)
    x = ((2 * (column + dx) + 1) / view.size - 1) * tangent
    y = (1 - (2 * (row + dy) + 1) / view.size) * tangent
    right, up, forward = view.axes()
    return x[:, None] * right + y[:, None] * up + forward, np.stack([column, row], axis=1)


def sky(directions: np.ndarray) -> np.ndarray:
    return shading.to_srgb(shading.sky(shading.default_light(), directions)) * 255


@pytest.mark.parametrize(("yaw", "pitch", "fov"), VIEWS)
def test_picture_matches_rays(tmp_path, yaw, pitch, fov):
    scene = make_scene(tmp_path, 3)
    eye = scene.origin + np.array([0.5, 0.2, -0.4])
    view = View(tuple(eye), yaw, pitch, fov, 40)
    near_field = NearField(tuple(scene.origin), 25.0)
    shooter = SceneShooter(scene)
    picture = shooter.shoot(view, near_field)
    shooter.close()

    distances = []
    for dx, dy in JITTER:
        directions, pixels = rays(view, dx, dy)
        hits = cast(scene, eye, directions, pixels)
        distances.append(hits.distance.min(axis=1))
    directions, pixels = rays(view)
    hits = cast(scene, eye, directions, pixels)
    distance = hits.distance.min(axis=1)
    sure = stable(distances)
    assert sure.mean() > 0.6
    rgba, far = picture.rgba.reshape(-1, 4), picture.far.ravel()
    geometry = np.isfinite(distance)
    assert 0.05 < geometry.mean() < 0.98
    np.testing.assert_array_equal(rgba[sure, 3], np.where(geometry, 255, 0)[sure])
    nearest = hits.distance.argmin(axis=1)
    expected = np.where(
        geometry[:, None], hits.color[np.arange(len(nearest)), nearest], sky(directions)
    )
    assert np.abs(rgba[sure, :3] - expected[sure]).max() <= 1.01
    points = eye + directions * np.where(geometry, distance, 0.0)[:, None]
    outside = np.abs(points - scene.origin).max(axis=1)
    clear = sure & (np.abs(outside - 25.0) > 1e-3)
    np.testing.assert_array_equal(far[clear], (geometry & (outside > 25.0))[clear])
    assert far.any()


def test_yaw_turns_left_and_pitch_up():
    right, up, forward = View((0.0, 0.0, 0.0), 0.0, 0.0).axes()
    np.testing.assert_allclose([right, up, forward], [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)
    assert np.allclose(View((0.0, 0.0, 0.0), np.pi / 2, 0.0).axes()[2], [-1, 0, 0])
    assert np.allclose(View((0.0, 0.0, 0.0), 0.0, np.pi / 2).axes()[2], [0, 1, 0])


def test_what_is_nearer_than_the_near_clip_is_cut(tmp_path):
    writer = SceneWriter()
    unlit = writer.batch(unlit=True)
    wall = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float64)
    writer.quad(unlit, wall * 0.1 + [0, 0, -0.05], color=(1.0, 0.0, 0.0, 1.0))
    writer.quad(unlit, wall * 50 + [0, 0, -10], color=(0.0, 1.0, 0.0, 1.0))
    shooter = SceneShooter(writer.write(tmp_path / "prepared"))
    eye = (0.0, 0.0, 0.0)
    assert (shooter.shoot(View(eye, 0.0, 0.0, size=8)).rgba == [0, 255, 0, 255]).all()
    close = View(eye, 0.0, 0.0, size=8, near=0.04)
    assert (shooter.shoot(close).rgba == [255, 0, 0, 255]).all()
    shooter.close()


def test_without_a_near_field_nothing_is_far(tmp_path):
    scene = make_scene(tmp_path, 3)
    shooter = SceneShooter(scene)
    picture = shooter.shoot(View(tuple(scene.origin), 0.0, 0.0, size=16))
    shooter.close()
    assert picture.rgba[..., 3].any()
    assert not picture.far.any()


@pytest.mark.parametrize(
    "options", [{"fov": 0.0}, {"fov": 180.0}, {"size": 0}, {"yaw": float("nan")}]
)
def test_impossible_views_are_refused(options):
    with pytest.raises(BadInputError):
        View(**{"eye": (0.0, 0.0, 0.0), "yaw": 0.0, "pitch": 0.0, **options})


def test_model_files_and_prepared_folders_are_shot_alike(tmp_path):
    model = tmp_path / "roof.obj"
    model.write_text("v -9 -4 -9\nv 9 -4 -9\nv 0 7 -12\nv 0 -4 -4\nf 1 2 3\nf 1 4 2\n")
    view = View((0.0, 0.0, 0.0), 0.1, -0.2, 80.0, 32)
    shoot_to_file(model, view, tmp_path / "model.png")
    prepare(model, tmp_path / "prepared", "roof", "roof")
    shoot_to_file(tmp_path / "prepared", view, tmp_path / "prepared.png")
    pictures = []
    for name in ("model.png", "prepared.png"):
        with Image.open(tmp_path / name) as image:
            pictures.append(np.asarray(image))
    np.testing.assert_array_equal(*pictures)
    assert set(np.unique(pictures[0][..., 3])) == {0, 255}


def test_empty_direction_shows_only_sky(tmp_path: Path):
    writer = SceneWriter()
    writer.box(writer.batch(), (10, 0, 0), (11, 1, 1))
    shooter = SceneShooter(writer.write(tmp_path / "prepared"))
    view = View((0.0, 0.0, 0.0), np.pi / 2, 0.3, size=16)
    picture = shooter.shoot(view)
    shooter.close()
    assert not picture.rgba[..., 3].any()
    expected = sky(rays(view)[0]).reshape(16, 16, 3)
    assert np.abs(picture.rgba[..., :3] - expected).max() <= 1.01
