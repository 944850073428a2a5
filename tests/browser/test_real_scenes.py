"""The main job, end to end: real models baked by the command line, served, walked in Chromium.

At each cell's centre and corners the browser's picture must equal `farfield shoot` of the walk's
files. At the centre it is compared with a full render of the scene, and from the corners it must
show no crack where near polygons meet the far field. Sizes are small unless FARFIELD_SOAK=1, which
looks from four centres and all their corners.
"""

import itertools
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from farfield.server import Server
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from farfield_core.cells import cell_name
from farfield_core.layout import prepared_prefix
from farfield_core.scene import open_scene
from farfield_core.walk import CellFile, Walk
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import NearField, Picture, View
from farfield_worker.shoot.walk import WalkShooter
from farfield_worker.verify.border import border
from farfield_worker.verify.metrics import Shot, compare, eroded, unmatched
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import BrowserContext

from tests.browser.conftest import Visit
from tests.corridors.scenes import DATA, SCENES, Scene

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
RESOLUTION, LAYERS, CELLS = (512, 64, 4) if SOAK else (256, 24, 2)
SIZE = 512 if SOAK else 256
#: looked from in turn, as shares of half a cell
CORNERS = tuple(itertools.product((1, -1), repeat=3))
ROOT = Path(__file__).parents[2]
RESULTS, PICTURES = ROOT / "bench" / "results", ROOT / "docs" / "pictures"

pytestmark = pytest.mark.data
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the real scenes are not there: no folder {DATA}"
)


def bake(scene: Scene, model: Path, folder: Path) -> Path:
    """Bake the beginning of the scene's corridor; returns the folder of its walk.json."""
    corridor = json.loads(scene.corridor.read_text(encoding="utf-8"))
    (x, y, z), *_ = corridor["path"]["points"]
    edge = scene.cell_size
    corridor["path"]["points"] = [[x, y, z], [x + (CELLS - 1.2) * edge, y, z]]
    corridor["path"]["width"] = 0.01 * edge
    return run_bake(model, corridor, edge, folder)


def run_bake(model: Path, corridor: dict[str, Any], edge: float, folder: Path) -> Path:
    """Run `farfield bake`; returns the folder of its walk.json."""
    file = folder / "corridor.json"
    file.write_text(json.dumps(corridor), encoding="utf-8")
    result = subprocess.run(
        [
            *(sys.executable, "-m", "farfield", "bake", str(model), "--corridor", str(file)),
            *("--out", str(folder / "out"), "--cell-size", str(edge), "--json"),
            *("--resolution", str(RESOLUTION), "--layers", str(LAYERS)),
        ],
        capture_output=True,
        text=True,
        timeout=1800,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    (walk,) = (folder / "out" / "bakes").glob("*/walk.json")
    return walk.parent


@contextmanager
def served(store: Path, web: Path) -> Iterator[str]:
    """Serve a store as `farfield serve` does; yields the server's address."""
    server = Server("127.0.0.1", 0)
    settings = ApiSettings.from_environment({"FARFIELD_WEB": str(web)}, store=str(store), jobs=1)
    with server.beside(create_app(settings)):
        yield server.address


def shot(picture: Picture) -> Shot:
    return Shot(picture.rgba[..., :3], picture.rgba[..., 3] > 0, picture.far)


def far_apart(seen: NDArray[np.uint8], drawn: Picture) -> dict[str, float]:
    """How the browser's picture (h, w, 4) differs from the one that `farfield shoot` draws."""
    wrong = max(
        unmatched(seen[..., :3], drawn.rgba[..., :3]).mean(),
        unmatched(drawn.rgba[..., :3], seen[..., :3]).mean(),
    )
    missing = eroded(drawn.rgba[..., 3] > 0) & (seen[..., 3] == 0)
    return {"wrong": float(wrong), "missing": int(missing.sum())}


def look_from_corners(
    cell: CellFile, walk: Walk, walks: WalkShooter, scenes: SceneShooter, visit: Visit
) -> tuple[NDArray[np.int64], dict[str, dict[str, float]]]:
    """Pixels at a cell's near border as its corners see it in the browser, and cracks there.

    And how the browser's pictures differ from those of `farfield shoot`, by the corner's number.
    """
    found = np.zeros(2, np.int64)
    apart = {}
    half = 0.95 * np.array(walk.grid.size) / 2
    for turn, corner in enumerate(CORNERS if SOAK else CORNERS[:1]):
        x, y, z = (np.array(cell.eyes[0]) + half * corner).tolist()
        yaw = walk.start.yaw + turn * math.pi / 2
        visit.go_to(x, y, z, yaw, -0.1)
        view = View((x, y, z), yaw, -0.1, 60.0, SIZE, 0.01 * min(walk.grid.size))
        near_field = NearField(cell.eyes[0], walk.near_field)
        pixels = visit.pixels()
        seen = border(scenes, view, near_field, pixels[..., 3] > 0)
        found += [int(seen.pixels.sum()), int(seen.cracks.sum())]
        apart[f"{cell_name(cell.cell)} corner {turn}"] = far_apart(
            pixels, walks.shoot(view, cell.cell)
        )
    return found, apart


def look_over(scene: Scene, model: Path, folder: Path, visit: Visit, web: Path) -> None:
    """Bake, serve, stand in every cell, and hold the browser's picture against both others."""
    bake_folder = bake(scene, model, folder)
    walk = Walk.model_validate_json((bake_folder / "walk.json").read_text(encoding="utf-8"))
    cells = [
        CellFile.model_validate_json(path.read_text(encoding="utf-8"))
        for path in sorted((bake_folder / "cells").glob("*.json"))
    ]
    assert len(cells) == walk.grid.total >= 2
    assert max(cell.figures["peak_megabytes"] for cell in cells) < 2048
    prepared = open_scene(folder / "out" / prepared_prefix(walk.scene.id))
    walks, scenes = WalkShooter(bake_folder), SceneShooter(prepared)
    clip = 0.01 * min(walk.grid.size)
    report: dict[str, dict[str, Any]] = {}
    found = np.zeros(2, np.int64)
    with served(folder / "out", web) as address:
        visit.page.set_viewport_size({"width": SIZE, "height": SIZE})
        visit.open(f"{address}/walk/{walk.id}?capture")
        for cell in cells:
            x, y, z = cell.eyes[0]
            for turn in range(4 if SOAK else 2):
                yaw, pitch = walk.start.yaw + turn * math.pi / 2, 0.05
                visit.go_to(x, y, z, yaw, pitch)
                seen = visit.pixels()
                view = View((x, y, z), yaw, pitch, 60.0, SIZE, clip)
                drawn = walks.shoot(view, cell.cell)
                full = shot(scenes.shoot(view, NearField((x, y, z), walk.near_field)))
                name = f"{cell_name(cell.cell)} yaw {yaw:.2f}"
                against = compare(full, Shot(seen[..., :3], seen[..., 3] > 0, drawn.far))
                report[name] = {
                    "browser": far_apart(seen, drawn),
                    "full render": None if against is None else against._asdict(),
                }
                sheet = np.concatenate([seen[..., :3], drawn.rgba[..., :3], full.rgb], axis=1)
                Image.fromarray(sheet).save(folder / f"{name.replace(' ', '_')}.png")
            pixels, apart = look_from_corners(cell, walk, walks, scenes, visit)
            found += pixels
            report |= {name: {"browser": f, "full render": None} for name, f in apart.items()}
    walks.close()
    scenes.close()
    if SOAK:
        RESULTS.mkdir(parents=True, exist_ok=True)
        text = json.dumps(report, indent=1)
        (RESULTS / f"real_scenes_{scene.name}.json").write_text(text + "\n", encoding="utf-8")
    at_border, cracks = found
    assert at_border > 0 or not SOAK  # one view may show none of it
    assert cracks == 0
    for name, figures in report.items():
        assert figures["browser"]["wrong"] <= 1e-3, (name, figures)
        assert figures["browser"]["missing"] == 0, (name, figures)
    shown = [f["full render"] for f in report.values() if f["full render"] is not None]
    total = sum(f["pixels"] for f in shown)
    # A walk of the wrong cell, or one that lacks a face, misses far more than this.
    assert sum(f["missing"] * f["pixels"] for f in shown) <= 0.02 * total, report
    assert sum(f["extra"] * f["pixels"] for f in shown) <= 0.05 * total, report


@needs_data
@pytest.mark.parametrize("scene", [s for s in SCENES.values() if s.source], ids=lambda s: s.name)
def test_a_real_model_is_baked_and_walked(
    scene: Scene, tmp_path: Path, visit: Visit, pages: Path
) -> None:
    look_over(scene, scene.model, tmp_path, visit, pages)


def test_the_picture_in_the_readme(tmp_path: Path, context: BrowserContext, pages: Path) -> None:
    """The page as `make demo` opens it; the soak run writes the README's picture anew."""
    from farfield_worker.demo import AVENUE, CELL_SIZE
    from farfield_worker.demo.city import write_city

    model = tmp_path / "Lake city.glb"
    write_city(model, triangles=850_000 if SOAK else 100_000)
    corridor = json.loads(AVENUE.read_text(encoding="utf-8"))
    (x, y, z), _ = corridor["path"]["points"]
    corridor["path"]["points"] = [[x, y, z], [x, y, z - 0.1 * CELL_SIZE]]
    bake_folder = run_bake(model, corridor, CELL_SIZE, tmp_path)
    page = context.new_page()
    page.set_viewport_size({"width": 1280, "height": 720})
    with served(tmp_path / "out", pages) as address:
        page.goto(f"{address}/walk/{bake_folder.name}")
        page.wait_for_function("window.farfield !== undefined")
        page.evaluate("farfield.ready")
        page.get_by_text("Near triangles").wait_for()
        page.wait_for_timeout(3000)
        file = tmp_path / "walk.png"
        page.screenshot(path=file)
    picture = np.asarray(Image.open(file).convert("RGB")).astype(int)
    sky, ground = picture[120, 300], picture[700, 600]
    assert sky[2] > sky[0] + 30, "the sky is blue"
    assert ground[0] >= ground[2], "the avenue is paved in a warm grey"
    assert len(np.unique(picture.reshape(-1, 3) // 16, axis=0)) > 150, "a city has many colours"
    if SOAK:
        PICTURES.mkdir(exist_ok=True)
        (PICTURES / "walk.png").write_bytes(file.read_bytes())


def test_the_demo_city_is_baked_and_walked(tmp_path: Path, visit: Visit, pages: Path) -> None:
    from farfield_worker.demo.city import write_city

    model = tmp_path / "city.glb"
    write_city(model, triangles=850_000 if SOAK else 100_000)
    look_over(SCENES["city"], model, tmp_path, visit, pages)
