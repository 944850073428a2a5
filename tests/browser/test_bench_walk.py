"""bench.walk: paths by reckoning, measuring on the painted room, all of it in the soak."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from farfield_core.corridor import cut, parse_corridor

from bench.browser import FRAMES
from bench.walk import CELL, along, avenue, follow, loop
from bench.walk_path import chart
from tests.browser.conftest import Visit
from tests.browser.server import WalkServer

SOAK = os.environ.get("FARFIELD_SOAK") == "1"


def test_the_loop_has_as_many_cells_as_are_asked_for() -> None:
    for columns, rows in ((18, 8), (3, 3)):
        points = loop(columns, rows)
        path = {"points": points, "width": 0.1 * CELL, "height": CELL}
        cells = cut(parse_corridor({"path": path}), (CELL, CELL, CELL), None)
        assert len(cells) == 2 * (columns + rows) - 4
    assert len(cut(parse_corridor(avenue(4)), (CELL, CELL, CELL), None)) == 4


def test_poses_are_evenly_spaced_and_look_ahead() -> None:
    poses = np.array(along([(0, 0, 0), (0, 0, -30), (10, 0, -30)], 80))
    steps = np.diff(poses[:, :3], axis=0)
    assert np.allclose(np.abs(steps).sum(axis=1), 0.5)
    ahead = np.stack([-np.sin(poses[:-1, 3]), -np.cos(poses[:-1, 3])], axis=1)
    # But for the step that leaves the corner, which the pose at the corner does not look along.
    along_view = (ahead * steps[:, [0, 2]]).sum(axis=1)
    assert np.flatnonzero(~np.isclose(along_view, 0.5)).tolist() == [60]
    assert poses[0, 3] == 0
    assert poses[-1, 3] == pytest.approx(-math.pi / 2)


def test_following_reports_every_place_once_it_can_be_seen(
    visit: Visit, server: WalkServer
) -> None:
    server.delays = {"/cells/": 0.2, "/atlases/": 0.05}
    visit.page.add_init_script(path=FRAMES)
    visit.open(f"{server.url}/walk/room?capture")
    poses = [[4 + 0.25 * n, 2.0, 4.0, 0.0, 0.0] for n in range(65)]
    log = follow(visit.page, poses, 2000)
    assert [frame["at"] for frame in {frame["at"]: frame for frame in log}.values()] == [*range(65)]
    assert {frame["cell"] for frame in log} == {"0_0_0", "1_0_0", "2_0_0"}
    assert all(frame["bytes"] <= frame["cap"] and frame["drawCalls"] in (1, 2) for frame in log)
    assert sum(frame["processor"] for frame in log) > 0
    assert log[-1]["wanted"] == log[-1]["cell"] == "2_0_0"


def test_charts_show_their_lines() -> None:
    picture = np.asarray(chart("title", [("a", (255, 0, 0), [1.0, 2.0, 3.0] * 20)], [7]))
    assert (picture == (255, 0, 0)).all(axis=-1).sum() > 500


@pytest.mark.skipif(not SOAK, reason="bakes three corridors of the demo city")
def test_a_walk_of_a_thousand_steps(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-m", "bench.walk", "--json"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert result.returncode == 0, result.stderr
    figures = json.loads(result.stdout.splitlines()[-1])
    assert figures["steps"] == 1000
    assert figures["cells_seen"] >= 48
    assert figures["frames_hole"] == figures["frames_other_cell"] == 0
    assert figures["frames_above_cap"] == 0
    assert figures["draw_calls_far"] <= 2
    assert figures["worst_processor"] <= 5
    assert figures["prefetch_processor"] <= 1.25
