"""Jitter moves the samples: by whole pixels it moves the picture by as many."""

from dataclasses import replace

import numpy as np
import pytest
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import View

from tests.unit.test_render_raycast import make_scene

pytestmark = pytest.mark.usefixtures("graphics")


def test_whole_pixels_shift_the_picture(tmp_path):
    scene = make_scene(tmp_path, 3)
    shooter = SceneShooter(scene)
    view = View(tuple(scene.origin + np.array([0.5, 0.2, -0.4])), 0.3, 0.1, 60, 64)
    still = shooter.shoot(view).rgba.astype(int)
    # multiples of four leave the dither pattern where it was
    moved = shooter.shoot(replace(view, jitter=(4.0, 8.0))).rgba.astype(int)
    shooter.close()
    same = (np.abs(moved[:-8, :-4] - still[8:, 4:]) <= 1).all(axis=2)
    assert same.mean() > 0.99
    assert (np.abs(moved - still) > 1).any()
