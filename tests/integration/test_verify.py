"""`farfield verify` on a small bake: all figures are there, and damage shows in the right one."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from farfield_worker.demo.city import write_city
from PIL import Image

NAMES = {"wrong", "missing", "extra", "flip", "psnr", "pop", "pixels"}


def farfield(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "farfield", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=800,
        check=False,
    )


def figures_of(walk: Path, *more: object) -> Any:
    result = farfield("verify", walk, "--views", 3, "--json", *more)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout.rstrip("\n").rsplit("\n", 1)[-1])


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bake of two neighbouring cells of a small demo city."""
    folder = tmp_path_factory.mktemp("verify")
    write_city(folder / "city.glb", triangles=50_000)
    corridor = {"box": {"min": [-119, 1, -99], "max": [-91, 15, -85]}}
    (folder / "corridor.json").write_text(json.dumps(corridor), encoding="utf-8")
    result = farfield(
        *("bake", folder / "city.glb", "--corridor", folder / "corridor.json"),
        *("--out", folder / "out", "--cell-size", 14, "--resolution", 128, "--layers", 16),
    )
    assert result.returncode == 0, result.stderr
    return folder / "out"


def test_every_figure_is_there(walk: Path, tmp_path: Path) -> None:
    figures = figures_of(walk, "--sheet", tmp_path / "sheet.png")
    assert len(figures["cells"]) == 2
    for part in (figures["overall"], *figures["cells"].values()):
        assert set(part) == NAMES | {"floor", "fine", "corners"}
        for whole in (part, part["fine"], part["corners"]):
            assert set(whole["floor"]) == NAMES
        for name in ("wrong", "missing", "extra", "flip"):
            assert 0 <= part["floor"][name] <= 1
            assert 0 <= part[name] <= 1
        assert 0 < part["flip"] < 0.5
        assert 5 < part["psnr"] < 60
        assert part["missing"] < 0.05
        assert part["pop"] is not None
        assert part["floor"]["pop"] == part["floor"]["flip"]
        assert part["fine"]["pixels"] > 2 * part["pixels"]
        assert part["corners"]["pixels"] < part["pixels"]
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width == 3 * 320


def test_views_may_have_other_pixels_than_faces_have_texels(walk: Path) -> None:
    coarse, usual = (figures_of(walk, *more)["overall"] for more in (("--pixels", 64), ()))
    assert coarse["fine"]["pixels"] == usual["pixels"]
    assert coarse["fine"]["wrong"] == usual["wrong"]
    assert coarse["pixels"] < usual["pixels"] / 3


def test_the_same_views_give_the_same_figures(walk: Path) -> None:
    assert figures_of(walk) == figures_of(walk)


def test_damage_shows(walk: Path, tmp_path: Path) -> None:
    """Wrong colours are wrong, not missing; empty pages are missing."""
    sound = figures_of(walk)["overall"]
    for damage, name in (
        (lambda p: p ^ np.uint8([64, 64, 64, 0]), "wrong"),
        (lambda p: p * 0, "missing"),
    ):
        copy = tmp_path / name
        shutil.copytree(walk, copy)
        for page in (copy / "blobs/atlases").iterdir():
            pixels = np.asarray(Image.open(page))
            Image.fromarray(damage(pixels)).save(page)
        damaged = figures_of(copy)["overall"]
        assert damaged[name] > sound[name] + 0.3
        if name == "wrong":
            assert damaged["missing"] == sound["missing"]


def test_a_store_without_its_scene_is_refused(walk: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(walk, copy)
    shutil.rmtree(copy / "scenes")
    result = farfield("verify", copy)
    assert result.returncode == 4
    assert "The scene of" in result.stderr
    assert "Traceback" not in result.stderr
