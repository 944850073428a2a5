"""The browser's picture of a walk equals one computed pixel by pixel from the same files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from farfield_worker.shoot.command import shoot
from farfield_worker.shoot.view import View
from numpy.typing import NDArray

from tests.browser.conftest import Visit
from tests.browser.oracle import draw_walk
from tests.browser.server import WalkServer

POSES = [
    # cell's centre, level; turned left and up; a corner of the cell; looking down; another cell
    ("0_0_0", (4.0, 2.0, 4.0, 0.0, 0.0)),
    ("0_0_0", (4.0, 2.0, 4.0, 2.1, 0.35)),
    ("0_0_0", (7.5, 3.6, 0.4, 0.4, -0.1)),
    ("0_0_0", (1.0, 1.0, 1.0, -1.2, -0.7)),
    ("1_0_1", (12.0, 2.0, 12.0, 0.3, 0.0)),
    ("2_0_0", (17.0, 0.5, 7.0, -2.5, 0.1)),
]


def wrong(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Share of pixels without a match within 8/255 in the other's 3x3 pixels, both ways."""

    def unmatched(p: NDArray[np.uint8], q: NDArray[np.uint8]) -> float:
        padded = np.pad(q.astype(int), ((1, 1), (1, 1), (0, 0)), mode="edge")
        best = np.full(p.shape[:2], 255)
        for dy in range(3):
            for dx in range(3):
                other = padded[dy : dy + p.shape[0], dx : dx + p.shape[1]]
                best = np.minimum(best, np.abs(other - p).max(axis=-1))
        return float((best > 8).mean())

    return max(unmatched(a, b), unmatched(b, a))


@pytest.mark.parametrize(("cell", "pose"), POSES)
def test_equals_oracle(
    visit: Visit, server: WalkServer, room: Path, cell: str, pose: tuple[float, ...]
) -> None:
    visit.open(f"{server.url}/walk/room?capture")
    visit.go_to(*pose)
    seen = visit.pixels()
    wanted = draw_walk(room, cell, (pose[0], pose[1], pose[2]), pose[3], pose[4], (256, 256))
    assert (wanted[..., 3] == 0).sum() == (seen[..., 3] == 0).sum() == 0
    different = (np.abs(seen.astype(int) - wanted).max(axis=-1) > 2).mean()
    # Pixels whose ray grazes an edge may fall either way in single precision.
    assert different < 2e-4
    assert wrong(seen, wanted) <= 1e-3


@pytest.mark.parametrize("walk", ["room", "smooth"])
@pytest.mark.parametrize(("cell", "pose"), POSES)
def test_equals_shoot(
    visit: Visit,
    server: WalkServer,
    walk: str,
    cell: str,
    pose: tuple[float, ...],
) -> None:
    visit.open(f"{server.url}/walk/{walk}?capture")
    visit.go_to(*pose)
    assert visit.call("return farfield.stats.cell") == cell
    view = View((pose[0], pose[1], pose[2]), pose[3], pose[4], size=256)
    wanted = shoot(server.walks[walk], view).rgba
    seen = visit.pixels()
    assert ((wanted[..., 3] == 0) == (seen[..., 3] == 0)).all()
    assert wrong(seen[..., :3], wanted[..., :3]) <= 1e-3
