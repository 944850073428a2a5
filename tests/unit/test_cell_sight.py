"""Layers without what no eye of the cell can see: less to store, the same to look at."""

import numpy as np
import pytest
from farfield_core.scenes import open_prepared
from farfield_core.tables import walk_grid
from farfield_worker.cell.bake import CellBaker
from farfield_worker.shoot.view import View
from farfield_worker.shoot.walk import WalkShooter, find_walk
from farfield_worker.verify.metrics import eroded

from tests.unit.cells import small_bake, town

pytestmark = pytest.mark.usefixtures("graphics")

INDEX = (0, 0, 0)


def walled(writer):
    """The town, behind a high wall that is near geometry on one side."""
    town(writer)
    writer.box(writer.batch(), (3, -2, -40), (3.5, 60, 40), color=(0.6, 0.5, 0.4, 1))


def baked(folder, visibility):
    walk, store = small_bake(folder, walled, visibility=visibility, resolution=64)
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    cell = baker.bake(INDEX, walk_grid(store, walk).centre(INDEX))
    baker.close()
    return walk, cell


def pictures(folder, views):
    shooter = WalkShooter(find_walk(folder / "store"))
    out = [shooter.shoot(view, INDEX).rgba for view in views]
    shooter.close()
    return out


def test_what_no_eye_sees_is_not_stored_and_not_missed(tmp_path):
    walk, with_all = baked(tmp_path / "off", "off")
    _, seen = baked(tmp_path / "on", "on")
    assert 0 < seen.figures["texels"] < 0.8 * with_all.figures["texels"]
    behind_wall = np.array(seen.quads.faces) == 0
    assert behind_wall.sum() < 0.2 * (np.array(with_all.quads.faces) == 0).sum()
    rng = np.random.default_rng(3)
    centre, half = np.array(seen.eyes[0]), np.array(walk.grid.size) / 2
    views = [
        View(tuple(centre + rng.uniform(-0.999, 0.999, 3) * half), yaw, 0.0, 60.0, 96, 0.02)
        for yaw in rng.uniform(-np.pi, np.pi, 12)
    ]
    differ = missing = 0.0
    for a, b in zip(
        pictures(tmp_path / "off", views),
        pictures(tmp_path / "on", views),
        strict=True,
    ):
        differ += (a != b).any(axis=2).mean() / len(views)
        missing += (eroded(a[..., 3] > 0) & (b[..., 3] == 0)).mean() / len(views)
    assert differ < 5e-3
    assert missing < 1e-3
