"""What object impostors save and cost, in Chromium on the machine's own GL.

    python -m bench.objects [--json] [--keep] [--scene forest_alpha.glb]

- `forest_ratio`: frame time of a walk through the forest, near field 100 m, with near-field objects
  as impostors : without; `forest_flip`: mean FLIP between the two;
- `load_worst`: worst frame : median while 500 objects, a tenth of them animated, are regenerated,
  `load_still_worst` the same while nothing is; those in processor time count that of the page and
  of the graphics process, which other programs do not lengthen;
- `true_ratio`: frame time of 10,000 true impostors : instances of the mesh of 5,120 triangles;
- `silhouette`: share of the mesh's outline pixels more than a pixel from the impostor's, 100
  directions, where a texel is a pixel;
- `ring_ms`: a frame of the page with 250,000 asteroids.

Both of a ratio are measured by turns in one run; every frame ends with a pixel read back.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import flip_evaluator
import numpy as np
from farfield_worker.demo.asteroid import write_asteroid
from farfield_worker.objects.command import bake_object
from farfield_worker.objects.error import outline_distance, sphere
from playwright.sync_api import Browser, sync_playwright

from bench.browser import Meter
from bench.stand import report
from tests.browser.conftest import FLAGS, WEB
from tests.browser.example import Example, Pixels
from tests.browser.server import WalkServer
from tests.corridors.scenes import SCENES

SIZE = 512
NEAR = 100.0
CELL = 6.0
BLOCKS, FRAMES = 8, 12
DIRECTIONS = 100
LOAD_FRAMES = 200
#: frames after which `auto` has tried all ways
TRIAL = 180


def figures() -> dict[str, Any]:
    """All figures by name."""
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as name, pages() as dist:
        folder = Path(name)
        model = scene_file()
        walk = bake_forest(model, folder)
        write_asteroid(folder / "stone.glb")
        bake_object(folder / "stone.glb", folder / "baked", 96)
        server = WalkServer(dist, {"forest": walk, "stone": folder})
        path = os.environ.get("FARFIELD_CHROMIUM")
        path = path or shutil.which("chromium") or shutil.which("google-chrome")
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
            found = {
                **forest(browser, server),
                **load(browser, server),
                **stones(browser, server),
                **silhouette(browser, server),
                **ring(browser, server),
            }
            browser.close()
        server.close()
    return found


@contextmanager
def pages() -> Iterator[Path]:
    """The built pages."""
    command = ["npm", "run", "build", "--silent", "-w", "@farfield/app"]
    subprocess.run(command, cwd=WEB, check=True, capture_output=True)
    yield WEB / "app" / "dist"


def scene_file() -> Path:
    """The forest: named on the command line, or one of the test data."""
    if "--scene" in sys.argv:
        return Path(sys.argv[sys.argv.index("--scene") + 1])
    return SCENES["forest_alpha"].model


def bake_forest(model: Path, folder: Path) -> Path:
    """Bake two cells with a wide near field; returns the folder of walk.json."""
    corridor = json.loads(SCENES["forest_alpha"].corridor.read_text(encoding="utf-8"))
    (x, y, z), *_ = corridor["path"]["points"]
    corridor["path"] |= {"points": [[x, y, z], [x + 0.9 * CELL, y, z]], "width": 0.06}
    (folder / "corridor.json").write_text(json.dumps(corridor), encoding="utf-8")
    command = [sys.executable, "-m", "farfield", "bake", str(model), "--quads", "slanted"]
    command += ["--corridor", str(folder / "corridor.json"), "--out", str(folder / "out")]
    command += ["--cell-size", str(CELL), "--near", str(NEAR), "--resolution", "256", "--json"]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "out"


def example(browser: Browser, server: WalkServer, query: str) -> Example:
    """A page of its own, refused where it is not the machine's GL."""
    context = browser.new_context(viewport={"width": SIZE, "height": SIZE})
    return Example(context.new_page()).show(server, query)


def close(*examples: Example) -> None:
    for one in examples:
        one.page.context.close()


WALK = """
const { walk } = objects.hooks;
const [ex, ey, ez] = walk.manifest.walk.start.eye;
// Along the corridor, looking from side to side.
globalThis.stand = (s) => {
  const yaw = 0.8 * Math.sin(3 * s) - 0.6;
  const x = ex + 4 * s;
  objects.stand.look([x, ey, ez], [x + Math.cos(yaw), ey, ez + Math.sin(yaw)]);
};
globalThis.settle = async () => {
  for (let quiet = 0; quiet < 30; ) {
    objects.stand.draw(performance.now() / 1000);
    await new Promise((done) => setTimeout(done, 10));
    const { waiting, taken } = walk.objects.stats;
    quiet = walk.settled && walk.idle && waiting + taken === 0 ? quiet + 1 : 0;
  }
};
stand(0);
await settle();
"""

WALK_FRAMES = """
const [from, to, frames] = args;
const gl = objects.stand.renderer.getContext();
const pixel = new Uint8Array(4);
const times = [];
for (let n = 0; n < frames; n++) {
  const start = performance.now();
  stand(from + (to - from) * n / frames);
  objects.stand.draw(start / 1000);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  times.push(performance.now() - start);
  await new Promise((done) => setTimeout(done, 0));
}
return times;
"""


def forest(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """The walk with and without object impostors, by turns along one path."""
    (walk,) = (server.walks["forest"] / "bakes").glob("*/walk.json")
    at = f"{server.url}/api/v1/walks/forest/bakes/{walk.parent.name}/walk.json"
    without, with_ = (
        example(browser, server, f"show=walk&near={near}&walk={at}") for near in ("never", "always")
    )
    times: dict[str, list[float]] = {"without": [], "with": []}
    flips = []
    for one in (without, with_):
        one.call(WALK)
        one.call(WALK_FRAMES, 0, 0, 10)
    for block in range(BLOCKS):
        span = (block / BLOCKS, (block + 1) / BLOCKS, FRAMES)
        times["without"] += without.call(WALK_FRAMES, *span)
        times["with"] += with_.call(WALK_FRAMES, *span)
        shots = []
        for one in (without, with_):
            one.call("stand(args[0]); objects.stand.draw(performance.now() / 1000)", span[1])
            shots.append(one.picture())
        flips.append(flip(*shots))
    stats = with_.call("return objects.hooks.walk.objects.stats")
    triangles = [
        one.call("return objects.stand.renderer.info.render.triangles") for one in (without, with_)
    ]
    close(without, with_)
    auto = example(browser, server, f"show=walk&near=auto&walk={at}")
    auto.call(WALK)
    auto.call("for (let n = 0; n < args[0]; n++) objects.stand.measure(0, 1, 0)", TRIAL)
    chosen = auto.call("return objects.hooks.walk.objects.way")
    close(auto)
    median = {name: float(np.median(values)) for name, values in times.items()}
    return {
        "forest_ratio": median["with"] / median["without"],
        "forest_mean_ratio": float(np.mean(times["with"]) / np.mean(times["without"])),
        "forest_flip": float(np.mean(flips)),
        "forest_ms": median,
        "forest_triangles": {"without": triangles[0], "with": triangles[1]},
        "forest_objects": stats,
        "forest_auto": chosen,
    }


def flip(a: Pixels, b: Pixels) -> float:
    """Mean FLIP of two pictures."""
    _, mean, _ = flip_evaluator.evaluate(a / np.float32(255), b / np.float32(255), "LDR")
    return float(mean)


def load(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """500 objects, of which 50 turn: frames while pictures are taken all the time.

    Beside them frames of the same page in which nothing changes, by turns: what their worst is
    above their median other programs have done.
    """
    busy, still = (
        example(browser, server, f"show=many&count=500&moving={moving}") for moving in (0.1, 0)
    )
    for one in (busy, still):
        one.call("for (let n = 0; n < 150; n++) objects.stand.measure(args[0] * n, 1, 1)", 0.03)
    meter = Meter()
    times: dict[str, list[float]] = {"busy": [], "still": [], "spent": []}
    for frame in range(LOAD_FRAMES):
        before = meter.milliseconds()
        times["busy"] += busy.call(
            "return objects.stand.measure(args[0], 1, 0)", 4.5 + 0.03 * frame
        )
        times["spent"].append(meter.milliseconds() - before)
        times["still"] += still.call("return objects.stand.measure(4.5, 1, 0)")
    taken = busy.stats()["takenInAll"]
    close(busy, still)

    def worst(name: str, share: float = 1.0) -> float:
        return float(np.quantile(times[name], share) / np.median(times[name]))

    return {
        "load_worst": worst("busy"),
        "load_p95": worst("busy", 0.95),
        "load_still_worst": worst("still"),
        "load_still_p95": worst("still", 0.95),
        "load_worst_processor": worst("spent"),
        "load_p95_processor": worst("spent", 0.95),
        "load_ms": float(np.median(times["busy"])),
        "load_pictures_taken": taken,
    } | first(browser, server)


def first(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """The frames in which 500 objects get their first pictures : frames of the objects themselves.

    The first three frames, which compile programs and bring up buffers either way, do not count.
    """
    spent: dict[str, list[float]] = {"with": [], "without": []}
    pages = {
        name: example(browser, server, f"show=many&count=500&moving=0.1{query}")
        for name, query in (("with", ""), ("without", "&without"))
    }
    meter = Meter()
    for frame in range(40):
        for name, page in pages.items():
            before = meter.milliseconds()
            page.call("objects.stand.measure(args[0], 1, 0)", 0.03 * frame)
            if frame >= 3:
                spent[name].append(meter.milliseconds() - before)
    close(*pages.values())
    return {"first_worst_processor": max(spent["with"]) / float(np.median(spent["without"]))}


def stones(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """10,000 stones as true impostors and as instances of their mesh, by turns."""
    one = example(browser, server, f"show=stones&count=10000&{stone(server)}")
    times: dict[str, list[float]] = {"impostor": [], "mesh": []}
    for kind in times:
        one.call("objects.hooks.use(args[0]); objects.stand.measure(0, 1, 0.1)", kind)
    for turn in range(4):
        for kind in times:
            one.call("objects.hooks.use(args[0])", kind)
            times[kind] += one.call("return objects.stand.measure(args[0], 2, 0.5)", turn)
    close(one)
    median = {name: float(np.median(values)) for name, values in times.items()}
    return {"true_ratio": median["impostor"] / median["mesh"], "true_ms": median}


def stone(server: WalkServer) -> str:
    at = f"{server.url}/api/v1/walks/stone"
    return f"object={at}/baked/object.json&model={at}/stone.glb"


def silhouette(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """The outline against the mesh's where a texel is a pixel."""
    one = example(browser, server, f"show=stones&count=1&{stone(server)}")
    focal = SIZE / 2 / np.tan(np.radians(30))
    away = focal * 2.6 / 96
    off = []
    rng = np.random.default_rng(1)
    turns = rng.normal(size=(DIRECTIONS, 3)) * 0.01 + sphere(DIRECTIONS)
    for direction in turns:
        seen = []
        for kind in ("mesh", "impostor"):
            one.call(
                "objects.hooks.use(args[0]); objects.stand.look(args[1], [0, 0, 0]);"
                "objects.stand.draw(0)",
                kind,
                [float(x) for x in away * direction],
            )
            seen.append(one.picture().max(axis=-1) > 0)
        off.append(outline_distance(seen[0], seen[1]))
    close(one)
    distance = np.concatenate(off)
    return {"silhouette": float((distance > 1).mean()), "outline_pixels": len(distance)}


def ring(browser: Browser, server: WalkServer) -> dict[str, Any]:
    """A frame of the page with a quarter of a million asteroids."""
    one = example(browser, server, "show=ring")
    driver = one.page.evaluate("objects.stand.driver")
    one.call("objects.stand.measure(0, 1, 0.1)")
    times = one.call("return objects.stand.measure(0, 5, 1)")
    close(one)
    return {"ring_ms": float(np.median(times)), "renderer": driver}


if __name__ == "__main__":
    report("objects", figures())
