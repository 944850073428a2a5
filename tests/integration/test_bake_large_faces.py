"""Faces of 2048 texels, 64 layers and all six of them, in less than 4 GB a process.

Small unless FARFIELD_SOAK=1: then the demo city as it is meant to be.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from farfield_core.walk import CellFile
from farfield_worker.demo.city import write_city

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
TRIANGLES, RESOLUTION, MEGABYTES = (850_000, 2048, 4096) if SOAK else (50_000, 512, 1024)


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("large") / "city.glb"
    write_city(path, triangles=TRIANGLES)
    return path


@pytest.mark.parametrize("quads", ["layers", "slanted"])
def test_large_faces_fit_in_memory(
    city: Path,
    quads: str,
    tmp_path: Path,
    record_testsuite_property: Callable[[str, object], None],
) -> None:
    corridor = tmp_path / "corridor.json"
    corridor.write_text(json.dumps({"box": {"min": [-1, 0, 20], "max": [1, 3, 22]}}))
    done = subprocess.run(
        [
            *(sys.executable, "-m", "farfield", "bake", str(city), "--corridor", str(corridor)),
            *("--out", str(tmp_path / "out"), "--cell-size", "14", "--layers", "64"),
            *("--resolution", str(RESOLUTION), "--faces", "all", "--quads", quads, "--jobs", "1"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (file,) = (tmp_path / "out").glob("bakes/*/cells/*.json")
    cell = CellFile.model_validate_json(file.read_text(encoding="utf-8"))
    # a cell without a far field would need no memory
    assert len(cell.quads.faces) > 100
    assert len(set(cell.quads.faces)) >= 4
    peak = cell.figures["peak_megabytes"]
    record_testsuite_property(f"large_faces_{quads}_megabytes", peak)
    assert 100 < peak < MEGABYTES
