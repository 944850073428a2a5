"""`farfield shoot` draws what the browser draws: two readers that share only the shading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from farfield_worker.shoot.view import View
from farfield_worker.shoot.walk import WalkShooter

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer
from tests.browser.test_picture import POSES


def test_equals_the_browser(visit: Visit, server: WalkServer, room: Path) -> None:
    visit.open(f"{server.url}/walk/room?capture")
    shooter = WalkShooter(room)
    for _, (x, y, z, yaw, pitch) in POSES:
        visit.go_to(x, y, z, yaw, pitch)
        seen = visit.pixels()
        shot = shooter.shoot(View((x, y, z), yaw, pitch, 60.0, 256))
        np.testing.assert_array_equal(seen[..., 3], shot.rgba[..., 3])
        difference = np.abs(seen.astype(int) - shot.rgba).max(axis=-1)
        # Rounding may differ by one; and a pixel on an edge may fall either way.
        assert (difference > 0).mean() < 0.05
        assert (difference > 1).mean() < 2e-4
    shooter.close()
