"""The browser's figures: the walk against the full model in three.js, and how evenly it streams.

    python -m bench.walk [--json] [--keep] [--quick]
    python -m bench.walk --path [--json] [--keep] [--quick]

The second is the paper's figures 8 and 9 (bench/walk_path.py). Headless Chromium on the machine's
own GL, one `readPixels` fence a frame. Frames that are compared are drawn in turn in one page
(`growth`: in two pages), the best of three from each place; ratios are medians. `growth` is the
walk of a model twelve times as large : the smaller one's, both baked with the same budget, and with
the same near border. The full model is
drawn by three.js with the walk's own light, its triangles merged per material in 16, 64 or 256
chunks that the frustum culls; the fastest of these counts. Figures named `processor` count the
processor time of the page and of the graphics process instead of the clock: on a busy machine
believe those. `--quick` is a small version of everything, for tests.
"""

from __future__ import annotations

import itertools
import math
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

from playwright.sync_api import Browser, Page

from bench.browser import Meter, bake, chromium, open_walk, served
from bench.stand import report

CHUNKS = (16, 64, 256)
CELL = 14.0
#: where the avenue begins: x, lowest y, z
AVENUE = (0.0, 1.3, 308.0)
#: height of the eye above the corridor's floor
EYE = 1.7


class Sizes(NamedTuple):
    """How much is done."""

    triangles: int
    grown: int
    tour: int
    around: int
    loop: tuple[int, int]
    steps: int
    rounds: int
    options: tuple[str, ...]
    slanted: tuple[str, ...]
    budget: tuple[str, ...]
    cap_megabytes: int


FULL = Sizes(
    *(850_000, 10_000_000, 4, 6, (18, 8), 1000, 3),
    ("--resolution", "512"),
    ("--quads", "slanted", "--near", "14.8"),
    ("--quads", "slanted", "--budget", "triangles=4000"),
    64,
)
QUICK = Sizes(
    *(60_000, 120_000, 1, 3, (3, 3), 60, 1),
    ("--resolution", "128", "--layers", "16"),
    ("--quads", "slanted", "--near", "30"),
    ("--quads", "slanted", "--budget", "triangles=4000"),
    24,
)

Pose = list[float]


def avenue(cells: int) -> dict[str, Any]:
    """A corridor of the avenue's first cells."""
    x, y, z = AVENUE
    end = [x, y, z - (cells - 0.9) * CELL]
    return {"path": {"points": [[x, y, z], end], "width": 0.1 * CELL, "height": CELL}}


def around_avenue(cells: int, directions: int) -> list[list[Pose]]:
    """For each of the avenue's first cells places in it, looking all around."""
    x, y, z = AVENUE
    tour = []
    for cell in range(cells):
        places = [(0.0, 0.0), (0.3, -0.3), (-0.3, 0.3)]
        poses = []
        for n in range(directions):
            dx, dz = places[n % len(places)]
            yaw = 2 * math.pi * n / directions
            poses.append([x + dx * CELL, y + EYE, z + (dz - cell) * CELL, yaw, 0.0])
        tour.append(poses)
    return tour


def loop(columns: int, rows: int) -> list[tuple[float, float, float]]:
    """Corners of a closed loop of cells, `columns` along the avenue and `rows` across."""
    x, y, z = AVENUE
    far, side = z - (columns - 1) * CELL, x + (rows - 1) * CELL
    return [(x, y, z), (x, y, far), (side, y, far), (side, y, z), (x, y, z)]


def along(points: list[tuple[float, float, float]], steps: int) -> list[Pose]:
    """Poses at equal distances along straight lines, looking ahead, turning at corners."""
    legs = list(itertools.pairwise(points))
    lengths = [math.dist(a, b) for a, b in legs]
    poses = []
    for n in range(steps):
        at = sum(lengths) * n / steps
        leg = 0
        while at > lengths[leg]:
            at -= lengths[leg]
            leg += 1
        (ax, ay, az), (bx, _, bz) = legs[leg]
        share = at / lengths[leg]
        yaw = math.atan2(ax - bx, az - bz)
        poses.append([ax + share * (bx - ax), ay + EYE, az + share * (bz - az), yaw, 0.0])
    return poses


def against_full_model(page: Page, sizes: Sizes) -> dict[str, Any]:
    """Full model : walk for each number of chunks; the least of them is `ratio`."""
    tour = around_avenue(sizes.tour, sizes.around)
    ratios, spent, walks, fulls = {}, {}, {}, {}
    for chunks in CHUNKS:
        page.evaluate("chunks => farfield.session.comparison.load(chunks)", chunks)
        if page.evaluate("farfield.session.comparison.state") != "ready":
            raise RuntimeError(str(page.evaluate("farfield.session.comparison.error?.message")))
        times = page.evaluate(
            "([cells, rounds]) => bench.pairs(cells, rounds)", [tour, sizes.rounds]
        )
        pairs = list(zip(times["full"], times["walk"], strict=True))
        ratios[chunks] = statistics.median(full / walk for full, walk in pairs)
        spent[chunks] = processor_ratio(page, sizes)
        walks[chunks] = statistics.median(times["walk"])
        fulls[chunks] = statistics.median(times["full"])
    best = min(ratios, key=lambda chunks: ratios[chunks])
    return {
        "ratio": ratios[best],
        "ratio_processor": min(spent.values()),
        "ratios_by_chunks": ratios,
        "walk_ms": walks[best],
        "full_ms": fulls[best],
    }


def growth(browser: Browser, walks: list[tuple[str, str]], sizes: Sizes) -> dict[str, Any]:
    """Walk's frame time with the larger model : with the smaller one, same places and settings."""
    pages = [open_walk(browser, address, walk, 512, 512) for address, walk in walks]
    times: list[list[float]] = [[] for _ in pages]
    for poses in around_avenue(1, sizes.around):
        for page in pages:
            page.evaluate("pose => farfield.goTo(...pose)", poses[0])
            page.evaluate("bench.rest()")
            page.evaluate("pose => bench.frame('walk', pose)", poses[0])
        for pose in poses:
            best = [math.inf for _ in pages]
            for _ in range(2 * sizes.rounds):
                for n, page in enumerate(pages):
                    best[n] = min(best[n], page.evaluate("pose => bench.frame('walk', pose)", pose))
            for n, value in enumerate(best):
                times[n].append(value)
    stats = [page.evaluate("farfield.stats") for page in pages]
    for page in pages:
        page.context.close()
    return {
        "growth": statistics.median(b / a for a, b in zip(*times, strict=True)),
        "growth_quads": [s["quads"] for s in stats],
        "growth_near_triangles": [s["nearTriangles"] for s in stats],
    }


def follow(page: Page, poses: list[Pose], frames: int) -> list[dict[str, Any]]:
    """Walk along poses; every frame's record, with the processor time that it took, ms."""
    page.evaluate("poses => { bench.poses = poses; }", poses)
    meter = Meter()
    log: list[dict[str, Any]] = []
    at = 0
    while at < len(poses) and len(log) < frames:
        before = meter.milliseconds()
        part = page.evaluate("at => bench.follow(bench.poses, at, 1)", at)
        log += [frame | {"processor": meter.milliseconds() - before} for frame in part["log"]]
        at = part["at"]
    return log


def processor_ratio(page: Page, sizes: Sizes) -> float:
    """Full model : walk in processor time, over places all around one cell."""
    (poses,) = around_avenue(1, sizes.around)
    page.evaluate("pose => farfield.goTo(...pose)", poses[0])
    page.evaluate("bench.rest()")
    meter = Meter()
    spent = {"walk": 0.0, "full": 0.0}
    for _ in range(sizes.rounds):
        for mode in spent:
            page.evaluate("([m, pose]) => bench.frame(m, pose)", [mode, poses[0]])
            before = meter.milliseconds()
            for pose in poses:
                page.evaluate("([m, pose]) => bench.frame(m, pose)", [mode, pose])
            spent[mode] += meter.milliseconds() - before
    return spent["full"] / spent["walk"]


def streaming(browser: Browser, address: str, walk: str, sizes: Sizes) -> dict[str, Any]:
    """A walk round a loop of cells that do not fit under the cap."""
    page = open_walk(browser, address, walk, 512, 512, f"&memory={sizes.cap_megabytes}")
    poses = along(loop(*sizes.loop), sizes.steps)
    page.evaluate("pose => farfield.goTo(...pose)", poses[0])
    page.evaluate("bench.rest()")
    log = follow(page, poses, 4 * sizes.steps)
    page.context.close()
    times = [frame["ms"] for frame in log]
    spent = [frame["processor"] for frame in log]
    median = statistics.median(times)
    busy_spent = [frame["processor"] for frame in log if frame["busy"]]
    idle_spent = [frame["processor"] for frame in log if not frame["busy"]]
    busy = [frame["ms"] for frame in log if frame["busy"]]
    idle = [frame["ms"] for frame in log if not frame["busy"]]
    moved = [frame for n, frame in enumerate(log) if n == 0 or frame["at"] > log[n - 1]["at"]]
    return {
        "prefetch": statistics.median(busy) / statistics.median(idle) if busy and idle else None,
        "prefetch_processor": statistics.median(busy_spent) / statistics.median(idle_spent)
        if busy and idle
        else None,
        "worst": max(times) / median,
        "worst_99": sorted(times)[int(0.99 * len(times))] / median,
        "worst_processor": max(spent) / statistics.median(spent),
        "worst_99_processor": sorted(spent)[int(0.99 * len(spent))] / statistics.median(spent),
        "median_ms": median,
        "steps": len(moved),
        "frames_waited": len(log) - len(moved),
        "frames_busy": len(busy),
        "frames_idle": len(idle),
        "cells_seen": len({frame["cell"] for frame in log}),
        "frames_hole": sum(frame["cell"] is None for frame in log),
        "frames_other_cell": sum(frame["cell"] != frame["wanted"] for frame in log),
        "frames_above_cap": sum(frame["bytes"] > frame["cap"] for frame in log),
        "texture_cap_megabytes": log[0]["cap"] / 2**20,
        "draw_calls_far": max(frame["drawCalls"] for frame in log),
    }


def figures(sizes: Sizes) -> dict[str, Any]:
    """Everything, from the models on."""
    from farfield_worker.demo.city import write_city  # noqa: PLC0415 - slow to import

    started = time.perf_counter()
    out: dict[str, Any] = {"load_at_start": os.getloadavg()[0]}
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as name, chromium() as browser:
        folder = Path(name)
        model = folder / "city.glb"
        write_city(model, triangles=sizes.triangles)
        tour = bake(model, avenue(sizes.tour), folder / "tour", *sizes.options, *sizes.slanted)
        with served(folder / "tour") as address:
            for label, width, height in (("512", 512, 512), ("720", 1280, 720)):
                page = open_walk(browser, address, tour, width, height)
                out["renderer"] = page.evaluate("farfield.renderer")
                for key, value in against_full_model(page, sizes).items():
                    head, _, tail = key.partition("_")
                    out["_".join(filter(None, (head, label, tail)))] = value
                page.context.close()
            larger = folder / "larger.glb"
            write_city(larger, triangles=sizes.grown)
            grown = bake(larger, avenue(1), folder / "grown", *sizes.options, *sizes.slanted)
            with served(folder / "grown") as other:
                found = growth(browser, [(address, tour), (other, grown)], sizes)
                out |= {f"{key}_same_near": value for key, value in found.items()}
        small, large = (
            bake(scene, avenue(1), folder / f"{scene.stem}_budget", *sizes.options, *sizes.budget)
            for scene in (model, larger)
        )
        with served(folder / "city_budget") as one, served(folder / "larger_budget") as other:
            out |= growth(browser, [(one, small), (other, large)], sizes)
        around = bake(
            model,
            {"path": {"points": loop(*sizes.loop), "width": 0.1 * CELL, "height": CELL}},
            folder / "loop",
            *sizes.options,
        )
        with served(folder / "loop") as address:
            out |= streaming(browser, address, around, sizes)
    out["load_at_end"] = os.getloadavg()[0]
    out["seconds"] = time.perf_counter() - started
    return out


if __name__ == "__main__":
    size = QUICK if "--quick" in sys.argv else FULL
    if "--path" in sys.argv:
        from bench.walk_path import path_figures

        report("walk_path", path_figures(size is QUICK))
    else:
        report("walk", figures(size))
