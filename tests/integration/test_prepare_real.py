"""The six real scenes, against what their attribution says of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from farfield_core.scene import PreparedScene, open_scene
from farfield_worker.near import NearBlocks, near_list, near_triangles
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("FARFIELD_TEST_DATA", ROOT / ".." / "shared" / "data")).resolve()

pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"there are no real scenes in {DATA}"),
]

#: file -> triangles drawn, size in units, most batches
SCENES = {
    "dover/dover.glb": (602_392, (12_750, None, 15_900), 1),
    "forest_alpha/forest_alpha.glb": (1_446_500, (480, 38, 480), 5),
    # its lines, which are left out, reach 16 units further along x
    "hotel_room/hotel_room.glb": (99_029, (6_499 - 16, 2_197, 9_995), 7),
    "medieval_town/medieval_town_2M.glb": (2_159_621, (900, 74, 785), 1),
    "medieval_town/medieval_town_3M.glb": (3_367_062, (1_460, 74, 1_270), 1),
    "pandora_indoor/pandora.obj": (60_810, (1_472, 448, 832), 1),
}

#: triangles without area in the sources
DEGENERATE = {"pandora_indoor/pandora.obj": 116}

PEAK = """
import json, sys
from farfield_core.memory import peak_bytes
from farfield_worker.prepare.command import main
code = main(sys.argv[1:])
print(json.dumps({"kilobytes": peak_bytes() // 1024}))
sys.exit(code)
"""


@pytest.fixture(scope="module", params=list(SCENES))
def real(request, tmp_path_factory) -> tuple[str, PreparedScene, int]:
    """A scene prepared in a process of its own, and that process's peak memory in kilobytes."""
    name = request.param
    out = tmp_path_factory.mktemp("real") / "prepared"
    arguments = ["--source", str(DATA / name), "--out", str(out), "--id", "s", "--name", name]
    done = subprocess.run(
        [sys.executable, "-c", PEAK, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    match = re.search(r'"kilobytes": (\d+)', done.stdout)
    assert match is not None
    return name, open_scene(out), int(match[1])


def test_triangles_and_size(real):
    name, scene, _ = real
    triangles, size, batches = SCENES[name]
    dropped = DEGENERATE.get(name, 0)
    assert scene.info.triangles == len(scene.triangles) == triangles - dropped
    if dropped:
        assert f"{dropped} triangles without area were left out." in scene.info.notes
    for measured, claimed in zip(
        np.subtract(scene.info.bounds.max, scene.info.bounds.min), size, strict=True
    ):
        assert claimed is None or measured == pytest.approx(claimed, abs=0.6)
    assert len(scene.info.batches) <= batches


def test_memory(real):
    _, _, kilobytes = real
    assert kilobytes < 2_000_000


def test_blocks(real):
    _, scene, _ = real
    first = 0
    for block in scene.info.blocks:
        assert block.first_triangle == first
        assert 0 < block.triangles <= 4096
        rows = np.asarray(scene.triangles[first : first + block.triangles])
        assert rows.min() >= block.first_vertex
        assert rows.max() < block.first_vertex + block.vertices
        first += block.triangles
    assert first == scene.info.triangles


def test_winding_agrees_with_normals(real):
    _, scene, _ = real
    corners = np.asarray(scene.triangles[:: max(1, len(scene.triangles) // 200_000)])
    p = scene.positions[corners].astype(np.float64)
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    agree = (normal * scene.normals[corners][..., :3].astype(np.float64).sum(axis=1)).sum(axis=1)
    # a sliver that rounding to single precision turned over decides nothing
    longest = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2).max(axis=1)
    fat = np.linalg.norm(normal, axis=1) > 1e-4 * longest**2
    assert fat.mean() > 0.99
    # 0: normals that lie in the plane of their triangle
    assert (agree[fat] >= 0).all()
    assert (agree[fat] > 0).mean() > 0.9999


def test_pictures(real):
    _, scene, _ = real
    view = scene.info.map
    assert view is not None
    with Image.open(scene.folder / view.file) as picture:
        assert picture.size == (view.width, view.height)
        assert max(picture.size) <= 1024
        shown = (np.asarray(picture)[..., 3] > 0).mean()
    # a room may have a ceiling that is culled from above, never everything
    assert shown > 0.02
    with Image.open(scene.folder / "thumbnail.png") as picture:
        assert picture.size == (512, 384)
        assert np.asarray(picture).std() > 5


def test_near_blocks(real):
    _, scene, _ = real
    files: dict[str, bytes] = {}
    near = NearBlocks(scene, files.__setitem__)
    middle = scene.info.blocks[len(scene.info.blocks) // 2]
    eye = scene.origin + np.array(middle.high)
    entries = near_list(scene, near_triangles(scene, eye, 40.0))
    assert entries
    for entry in entries[:3]:
        data = files["blobs/near/" + near.blob(entry.block)]
        assert len(data) < 100 * scene.info.blocks[entry.block].triangles + 10_000
