"""Real scenes through `farfield bake`, as a user runs it: two cells each, small settings."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from farfield_core import format as walk_format
from farfield_core.store import Store
from farfield_core.validation import parse
from farfield_core.walk import CellFile, Walk

from tests.corridors.scenes import DATA, SCENES, Scene

SMALL = ["--resolution", "256", "--layers", "12", "--jobs", "2", "--json"]

needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the real scenes are not there: no folder {DATA}"
)


def two_cells(scene: Scene, folder: Path) -> Path:
    """The scene's corridor, cut down to its first cell and the one east of it."""
    corridor = json.loads(scene.corridor.read_text(encoding="utf-8"))
    x, y, z = corridor["path"]["points"][0]
    corridor["path"]["points"] = [[x, y, z], [x + 0.8 * scene.cell_size, y, z]]
    corridor["path"]["width"] = 0.01 * scene.cell_size
    file = folder / f"{scene.name}.json"
    file.write_text(json.dumps(corridor), encoding="utf-8")
    return file


def command(scene: Scene, folder: Path, quads: str = "layers") -> list[str]:
    corridor = two_cells(scene, folder)
    return [
        *(sys.executable, "-m", "farfield", "bake", str(scene.model)),
        *("--corridor", str(corridor), "--out", str(folder / "out")),
        *("--cell-size", str(scene.cell_size), "--quads", quads, *SMALL),
    ]


def last_line(text: str) -> Any:
    return json.loads(text.rstrip("\n").rsplit("\n", 1)[-1])


def check_store(folder: Path, figures: dict[str, Any]) -> None:
    """Every file of the bake keeps its format, and everything it names exists."""
    store = Store.open(folder, create=False)
    bake = figures["bake"]
    data = store.get(f"bakes/{bake}/walk.json")
    walk_format.validate("walk", walk_format.load(data))
    walk = parse(Walk, data, "walk.json")
    assert list(walk_format.walk_faults(walk)) == []
    cells = sorted(store.list(f"bakes/{bake}/cells/"))
    assert len(cells) == walk.grid.total == figures["cells"]
    quads = []
    for key in cells:
        data = store.get(key)
        walk_format.validate("cell", walk_format.load(data))
        cell = parse(CellFile, data, key)
        assert list(walk_format.cell_faults(cell, walk)) == []
        assert all(store.exists(f"blobs/atlases/{name}") for name in cell.atlases)
        assert all(store.exists(f"blobs/near/{block.blob}") for block in cell.near)
        quads.append(len(cell.quads.faces))
    assert figures["quads"] == pytest.approx(sum(quads) / len(quads))


@pytest.mark.data
@needs_data
@pytest.mark.parametrize("scene", [s for s in SCENES.values() if s.source], ids=lambda s: s.name)
def test_a_real_scene(scene: Scene, tmp_path: Path) -> None:
    bakes = set()
    for quads in ("layers", "slanted"):
        arguments = command(scene, tmp_path, quads)
        result = subprocess.run(arguments, capture_output=True, text=True, timeout=800, check=False)
        assert result.returncode == 0, result.stderr
        figures = last_line(result.stdout)
        assert figures["cells"] == 2
        assert figures["failed"] == 0
        for name in ("seconds_per_cell", "quads", "texels", "near_triangles", "atlas_bytes"):
            assert figures[name] > 0, name
        check_store(tmp_path / "out", figures)
        assert ("Preparing" in result.stderr) == (not bakes)
        bakes.add(figures["bake"])
    assert {path.name for path in (tmp_path / "out" / "bakes").iterdir()} == bakes


@pytest.mark.data
@needs_data
def test_interrupted_and_run_again(tmp_path: Path) -> None:
    scene = SCENES["forest_alpha"]
    arguments = [*command(scene, tmp_path), "--jobs", "1"]
    cells = tmp_path / "out" / "bakes"
    baking = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 600
    while not list(cells.glob("*/cells/*.json")):
        assert baking.poll() is None, baking.communicate()[1]
        assert time.monotonic() < end
        time.sleep(0.02)
    baking.send_signal(signal.SIGINT)
    _, words = baking.communicate(timeout=60)
    assert baking.returncode == 130
    assert "1 of 2 cells are baked; run the same command again to bake the rest." in words
    (first,) = cells.glob("*/cells/*.json")
    written = (first.stat().st_mtime_ns, first.read_bytes())
    result = subprocess.run(arguments, capture_output=True, text=True, timeout=800, check=False)
    assert result.returncode == 0, result.stderr
    assert (first.stat().st_mtime_ns, first.read_bytes()) == written
    assert "Preparing" not in result.stderr
    assert last_line(result.stdout)["cells"] == 2
    check_store(tmp_path / "out", last_line(result.stdout))


@pytest.mark.data
@needs_data
def test_a_broken_model_leaves_nothing_behind(tmp_path: Path) -> None:
    whole = SCENES["hotel_room"].model.read_bytes()
    broken = tmp_path / "broken.glb"
    broken.write_bytes(whole[: len(whole) // 2])
    corridor = two_cells(SCENES["hotel_room"], tmp_path)
    result = subprocess.run(
        [
            *(sys.executable, "-m", "farfield", "bake", str(broken)),
            *("--corridor", str(corridor), "--out", str(tmp_path / "out")),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 3
    assert "broken.glb" in result.stderr
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out").exists()
