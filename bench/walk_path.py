"""The paper's figures 8 and 9: a recorded path through 11 x 27 cells, frame by frame.

    python -m bench.walk --path [--json] [--keep] [--quick]

Figure 8 is the frame time of the walk and of the full model along the path, figure 9 the
polygons drawn: near, far and in all; rules mark where another cell is shown. The path goes down
the corridor, across and back, 2,197 frames as in the paper, looking ahead. Both models are
drawn in turn from every place. The pictures go to docs/pictures, the recorded path, which the
page plays with `?path=`, to bench/results; or both to the folder FARFIELD_FIGURES.
"""

from __future__ import annotations

import json
import os
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from bench.browser import ROOT, bake, chromium, open_walk, served
from bench.stand import RESULTS
from bench.walk import AVENUE, CELL, FULL, QUICK, along

#: cells across and along, frames, triangles
PAPER = (11, 27, 2197, 850_000)
SMALL = (2, 3, 40, 60_000)
WIDTH, HEIGHT, MARGIN = 1000, 320, 60
BLUE, RED, GREY, BLACK = (31, 94, 168), (192, 57, 43), (205, 205, 205), (20, 20, 20)


def path_figures(quick: bool) -> dict[str, Any]:
    """Bake, walk the path, draw; medians and the means of what was drawn."""
    across, length, frames, triangles = SMALL if quick else PAPER
    sizes = QUICK if quick else FULL
    options = (*sizes.options, *sizes.slanted)
    from farfield_worker.demo.city import write_city  # noqa: PLC0415 - slow to import

    started = time.perf_counter()
    load = os.getloadavg()[0]
    x, y, z = AVENUE
    low = [x - across // 2 * CELL - CELL / 2, y, z + CELL / 2 - length * CELL]
    high = [low[0] + across * CELL, y + CELL, z + CELL / 2]
    far = z - (length - 1) * CELL
    side = low[0] + CELL / 2
    points = [(x, y, z), (x, y, far), (side, y, far), (side, y, z)]
    poses = along(points, frames)
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as name, chromium() as browser:
        folder = Path(name)
        model = folder / "city.glb"
        write_city(model, triangles=triangles)
        corridor = {"box": {"min": low, "max": high}}
        walk = bake(model, corridor, folder / "store", *options)
        with served(folder / "store") as address:
            page = open_walk(browser, address, walk, 512, 512)
            page.evaluate("farfield.session.comparison.load(64)")
            page.evaluate("poses => { bench.poses = poses; }", poses)
            page.evaluate("pose => farfield.goTo(...pose)", poses[0])
            page.evaluate("bench.rest()")
            log: list[dict[str, Any]] = []
            at = 0
            while at < len(poses):
                part = page.evaluate("at => bench.follow(bench.poses, at, 50, true)", at)
                log += part["log"]
                at = part["at"]
            total = page.evaluate("farfield.session.comparison.triangles")
    # A frame that waits for a cell repeats its place; the last one there counts.
    last = list({frame["at"]: frame for frame in log}.values())
    changes = [n for n in range(1, len(last)) if last[n]["cell"] != last[n - 1]["cell"]]
    ratio = statistics.median(frame["full"] / frame["ms"] for frame in last)
    out = {
        "cells": across * length,
        "frames": len(last),
        "frames_waited": len(log) - len(last),
        "cell_changes": len(changes),
        "walk_ms": statistics.median(frame["ms"] for frame in last),
        "full_ms": statistics.median(frame["full"] for frame in last),
        "ratio": ratio,
        "near_triangles": statistics.mean(frame["near"] for frame in last),
        "far_quads": statistics.mean(frame["quads"] for frame in last),
        "full_triangles": total,
        "load_at_start": load,
        "seconds": time.perf_counter() - started,
    }
    pictures = Path(os.environ.get("FARFIELD_FIGURES", ROOT / "docs" / "pictures"))
    pictures.mkdir(parents=True, exist_ok=True)
    chart(
        "Figure 8: frame time, ms",
        [
            ("full model", RED, [frame["full"] for frame in last]),
            ("walk", BLUE, [frame["ms"] for frame in last]),
        ],
        changes,
    ).save(pictures / "walk_path_8.png")
    chart(
        "Figure 9: polygons of the walk",
        [
            ("near and far", BLACK, [frame["near"] + frame["quads"] for frame in last]),
            ("far: quads", BLUE, [frame["quads"] for frame in last]),
            ("near: triangles", RED, [frame["near"] for frame in last]),
        ],
        changes,
    ).save(pictures / "walk_path_9.png")
    recorded = {"format": "farfield-path", "version": 1, "rate": 30, "poses": poses}
    target = Path(os.environ.get("FARFIELD_FIGURES", RESULTS))
    (target / "walk_path_recorded.json").write_text(json.dumps(recorded) + "\n", encoding="utf-8")
    return out


def chart(
    title: str, lines: list[tuple[str, tuple[int, int, int], list[float]]], changes: list[int]
) -> Image.Image:
    """Lines over frames; rules where the cell changes."""
    picture = Image.new("RGB", (WIDTH, HEIGHT), "white")
    draw = ImageDraw.Draw(picture)
    count = len(lines[0][2])
    ordered = sorted(value for _, _, values in lines for value in values)
    # A few frames far above all others would press the rest flat.
    most = 1.15 * ordered[int(0.995 * (len(ordered) - 1))]

    def place(frame: int, value: float) -> tuple[float, float]:
        across = (WIDTH - 2 * MARGIN) * frame / max(1, count - 1)
        up = (HEIGHT - 2 * MARGIN) * min(1.0, value / most)
        return MARGIN + across, HEIGHT - MARGIN - up

    for frame in changes:
        draw.line([place(frame, 0), place(frame, most)], fill=GREY)
    for n in range(5):
        value = most * n / 4
        at = place(0, value)
        draw.line([(at[0] - 4, at[1]), at], fill=BLACK)
        draw.text((at[0] - 8, at[1]), f"{value:,.0f}", fill=BLACK, anchor="rm")
    draw.line([place(0, most), place(0, 0), place(count - 1, 0)], fill=BLACK)
    for name, color, values in lines:
        draw.line([place(n, value) for n, value in enumerate(values)], fill=color)
        index = [label for label, _, _ in lines].index(name)
        draw.text((WIDTH - MARGIN, 14 + 14 * index), name, fill=color, anchor="rm")
    draw.text((MARGIN, 20), title, fill=BLACK, anchor="lm")
    draw.text((WIDTH / 2, HEIGHT - 22), f"frame, 0 to {count - 1}", fill=BLACK, anchor="mm")
    return picture
