"""Cells baked with visibility on and off: what is listed and stored, and what their files show."""

import math

import numpy as np
import pytest
from farfield_core.scenes import open_prepared
from farfield_core.tables import walk_grid
from farfield_worker.cell.bake import CellBaker
from farfield_worker.shoot.view import View
from farfield_worker.shoot.walk import WalkShooter

from tests.unit.cells import small_bake

pytestmark = pytest.mark.usefixtures("graphics")

INDEX = (0, 0, 0)
HALF = 1.0


def courtyard(writer) -> None:
    """Walls with a gate around the cell, furniture behind them, houses far off."""
    rng = np.random.default_rng(8)
    batch = writer.batch()
    for x in range(-6, 6):
        for z in range(-6, 6):
            tile = np.array([[0, -2, 30], [30, -2, 30], [30, -2, 0], [0, -2, 0]])
            writer.quad(batch, tile + np.array([30 * x, 0, 30 * z]), color=(0.2, 0.4, 0.1, 1))
    wall = (0.7, 0.6, 0.5, 1)
    for low, high in (
        ((-6, -2, -6), (6, 2, -5.5)),
        ((-6, -2, 5.5), (6, 2, 6)),
        ((-6, -2, -5.5), (-5.5, 2, 5.5)),
        ((5.5, -2, -5.5), (6, 2, -1)),
        ((5.5, -2, 1), (6, 2, 5.5)),
    ):
        writer.box(batch, low, high, color=wall)
    for _ in range(60):
        x, z = rng.uniform(-9, 9, 2)
        if max(abs(x), abs(z)) > 6.3:
            size = rng.uniform(0.1, 0.5, 3)
            writer.box(batch, (x, -2, z), (x + size[0], -2 + size[1], z + size[2]))
    for distance in np.exp(rng.uniform(np.log(14), np.log(90), 80)):
        angle = rng.uniform(0, 2 * np.pi)
        x, z = distance * np.cos(angle), distance * np.sin(angle)
        size = rng.uniform(0.05, 0.25, 3) * distance
        color = (*rng.uniform(0.1, 1, 3), 1)
        writer.box(batch, (x, -2, z), (x + size[0], -2 + size[1], z + size[2]), color=color)


def bake(folder, **settings):
    walk, store = small_bake(folder, courtyard, resolution=96, **settings)
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    cell = baker.bake(INDEX, walk_grid(store, walk).centre(INDEX))
    baker.close()
    return walk, store, cell


def pictures(walk, store, cell):
    shooter = WalkShooter(store.local_path(f"bakes/{walk.id}/walk.json"))
    rng = np.random.default_rng(4)
    out = []
    for _ in range(40):
        eye = np.array(cell.eyes[0]) + HALF * rng.uniform(-1, 1, 3)
        yaw, pitch = rng.uniform(-math.pi, math.pi), math.asin(rng.uniform(-0.7, 0.7))
        view = View(tuple(eye.tolist()), yaw, pitch, 60.0, 96)
        out.append(shooter.shoot(view, cell.cell).rgba)
    shooter.close()
    return np.array(out)


def listed(cell):
    """(blob, primitive, triangle) of each near triangle of a cell."""
    return {
        (part.blob, primitive, triangle)
        for part in cell.near
        for primitive, first, count in np.array(part.ranges).reshape(-1, 3).tolist()
        for triangle in range(first, first + count)
    }


@pytest.mark.parametrize("quads", ["layers", "slanted"])
def test_what_no_eye_sees_is_left_out_and_nobody_sees_a_difference(tmp_path, quads):
    settings = {"quads": quads, "near": 12.0}
    _, _, off = whole = bake(tmp_path / "off", visibility="off", **settings)
    shown = pictures(*whole)
    counts = {}
    for effort in ("fast", "on", "careful"):
        _, _, cell = seen = bake(tmp_path / effort, visibility=effort, **settings)
        assert listed(cell) < listed(off)
        assert len(listed(cell)) == cell.figures["near_triangles"]
        assert cell.figures["near_triangles_inside"] == off.figures["near_triangles"]
        assert cell.figures["near_triangles"] < 0.7 * off.figures["near_triangles"]
        assert cell.figures["texels"] < 0.8 * off.figures["texels"]
        pixels = pictures(*seen)
        assert (shown[..., 3] > 0).mean() > 0.3
        # quads of any slant are cut differently where texels are missing: they may move a little
        sky = (shown[..., 3] > 0) & (pixels[..., 3] == 0)
        assert sky.mean() <= 3e-4
        if quads == "layers":
            assert np.any(shown != pixels, axis=-1).mean() <= 3e-4
        counts[effort] = cell.figures["eyes"]
    assert off.figures["eyes"] == 0
    assert counts["fast"] == 15 <= counts["on"] <= counts["careful"]
