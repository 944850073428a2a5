"""Jitter moves the samples: by a whole pixel it moves the picture by one."""

from dataclasses import replace

import numpy as np
import pytest
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import View

from tests.unit.test_render_raycast import make_scene

pytestmark = pytest.mark.usefixtures("graphics")


def test_a_whole_pixel_shifts_the_picture(tmp_path):
    scene = make_scene(tmp_path, 3)
    shooter = SceneShooter(scene)
    view = View(tuple(scene.origin + np.array([0.5, 0.2, -0.4])), 0.3, 0.1, 60, 64)
    still = shooter.shoot(view).rgba.astype(int)
    moved = shooter.shoot(replace(view, jitter=(1.0, 2.0))).rgba.astype(int)
    shooter.close()
    same = (np.abs(moved[:-2, :-1] - still[2:, 1:]) <= 1).all(axis=2)
    assert same.mean() > 0.99
    assert (np.abs(moved - still) > 1).any()
