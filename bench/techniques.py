"""One scene under every technique: pictures side by side, error, frame time and what is drawn.

    python -m bench.techniques [--json] [--keep]

The first cell of forest_alpha's corridor (FARFIELD_TEST_DATA), 512 texels, 512 x 512 pixels, in
Chromium on the machine's own GL:

- polygons: the whole scene as near field;
- layers: the paper's 64 layers, polygons within 25 m;
- slanted quads: with the border that the bake chooses;
- pictures, true impostors: slanted quads beyond 60 m, and of the polygons within, separate objects
  as pictures, copies as height fields.

`flip` is the mean against full renders (`farfield shoot`) over four directions; what polygons come
to in the same browser is the least that it can be. `frame` is the median processor time of a frame,
page and graphics process, in parts of the polygons', all by turns. With --keep the picture goes
into docs/pictures too.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core import layout
from farfield_core.bake import read_walk
from farfield_core.scene import open_scene
from farfield_core.store import Store
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import View
from PIL import Image
from playwright.sync_api import sync_playwright

from bench.browser import Meter
from bench.objects import close, example, flip, pages
from bench.stand import report
from tests.browser.conftest import FLAGS
from tests.browser.example import Example, Pixels
from tests.browser.server import WalkServer
from tests.corridors.scenes import SCENES

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
Eye = tuple[float, float, float]

SCENE = SCENES["forest_alpha"]
SIZE = 512
#: turns of all techniques, and frames of each in one
TURNS, FRAMES = 6, 4
YAWS = (0.3, 1.87, 3.44, 5.01)

#: name -> options of its bake, and which objects of the near field are drawn how
TECHNIQUES = {
    "polygons": (("--near", "5000"), "never"),
    "layers": (("--quads", "layers", "--layers", "64"), "never"),
    "slanted quads": ((), "never"),
    "pictures": (("--near", "60"), "always"),
    "true impostors": (("--near", "60"), "copies"),
}

SETTLE = """
const { walk } = objects.hooks;
objects.stand.look(args[0], args[1]);
for (let quiet = 0; quiet < 10; ) {
  objects.stand.draw(performance.now() / 1000);
  await new Promise((done) => setTimeout(done, 10));
  const { waiting, taken } = walk.objects.stats;
  quiet = walk.settled && walk.idle && waiting + taken === 0 ? quiet + 1 : 0;
}
"""

DRAWN = """
const { render } = objects.stand.renderer.info;
return { triangles: render.triangles, calls: render.calls };
"""


def bake(folder: Path, options: tuple[str, ...]) -> Path:
    """Bake the cell with `options` into its own store; returns the bake's folder."""
    corridor = json.loads(SCENE.corridor.read_text(encoding="utf-8"))
    corridor["path"]["points"] = corridor["path"]["points"][:1]
    corridor["path"]["width"] = 0.1
    folder.mkdir()
    (folder / "corridor.json").write_text(json.dumps(corridor), encoding="utf-8")
    command = [sys.executable, "-m", "farfield", "bake", str(SCENE.model), "--json", *options]
    command += ["--corridor", str(folder / "corridor.json"), "--out", str(folder / "out")]
    command += ["--cell-size", str(SCENE.cell_size)]
    subprocess.run(command, check=True, capture_output=True)
    (walk,) = (folder / "out" / "bakes").glob("*/walk.json")
    return walk.parent


def truth(store: Path, scene: str, eye: Eye) -> list[Pixels]:
    """Full renders in all directions."""
    shooter = SceneShooter(open_scene(store / layout.prepared_prefix(scene)))
    views = [View(eye, yaw, 0.0, 60.0, SIZE, 0.1) for yaw in YAWS]
    shown = [np.asarray(shooter.shoot(view).rgba[..., :3]) for view in views]
    shooter.close()
    return shown


def figures() -> dict[str, Any]:
    """Figures by technique."""
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as name, pages() as dist:
        baked: dict[tuple[str, ...], Path] = {}
        for number, (options, _) in enumerate(TECHNIQUES.values()):
            if options not in baked:
                baked[options] = bake(Path(name) / str(number), options)
        first = next(iter(baked.values()))
        walk = read_walk(Store.open(str(first.parents[1])), first.name)
        true = truth(first.parents[1], walk.scene.id, walk.start.eye)
        server = WalkServer(
            dist, {str(n): bake.parents[1] for n, bake in enumerate(baked.values())}
        )
        path = shutil.which("chromium") or shutil.which("google-chrome")
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
            shown = {}
            for technique, (options, near) in TECHNIQUES.items():
                number = list(baked).index(options)
                at = f"{server.url}/api/v1/walks/{number}/bakes/{baked[options].name}/walk.json"
                shown[technique] = example(browser, server, f"show=walk&near={near}&walk={at}")
            found = measure(shown, walk.start.eye, true)
            close(*shown.values())
            browser.close()
        server.close()
    return found


def measure(shown: dict[str, Example], eye: Eye, true: list[Pixels]) -> dict[str, Any]:
    """Look in every direction with every technique."""
    meter = Meter()
    flips: dict[str, list[float]] = {name: [] for name in shown}
    spent: dict[str, list[float]] = {name: [] for name in shown}
    drawn: dict[str, list[dict[str, int]]] = {name: [] for name in shown}
    sheet: list[Pixels] = []
    for number, (yaw, full) in enumerate(zip(YAWS, true, strict=True)):
        at = [eye[0] - math.sin(yaw), eye[1], eye[2] - math.cos(yaw)]
        for name, page in shown.items():
            page.call(SETTLE, list(eye), at)
            page.call("objects.stand.draw(performance.now() / 1000)")
            picture = page.picture()
            flips[name].append(flip(full, picture))
            drawn[name].append(page.call(DRAWN))
            if number == 0:
                sheet.append(picture)
        for _ in range(TURNS):
            for name, page in shown.items():
                before = meter.milliseconds()
                page.call("objects.stand.measure(performance.now() / 1000, args[0], 0)", FRAMES)
                spent[name].append((meter.milliseconds() - before) / FRAMES)
    if "--keep" in sys.argv:
        rows = [np.concatenate(row, axis=1) for row in ([true[0], *sheet[:2]], sheet[2:])]
        Image.fromarray(np.concatenate(rows)).save(PICTURES / "techniques.jpg", quality=88)
    whole = float(np.median(spent["polygons"]))
    table = {
        name: {
            "flip": float(np.mean(flips[name])),
            "frame": float(np.median(spent[name])) / whole,
            "triangles": float(np.mean([one["triangles"] for one in drawn[name]])),
            "calls": float(np.mean([one["calls"] for one in drawn[name]])),
        }
        for name in shown
    }
    return {"scene": SCENE.name, "pixels": SIZE, **table}


if __name__ == "__main__":
    report("techniques", figures())
