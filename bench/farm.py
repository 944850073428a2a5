"""A million cells on one machine.

    python -m bench.farm [--cells N] [--queue N] [--json] [--keep]

The feeder, the queue in a real Redis and the store's index are real, and the cells are stand-ins
that a few lines write. `--queue` of them pass through the queue; the others are written behind the
feeder's back, as a second farm over the same store would, and have to be found by listing. Set
TMPDIR to a file system in memory: on a busy disk, removing a million files takes an hour.

Figures: megabytes of the feeder's process, the greatest length of the queue, the slowest of all
calls for progress in ms, and operations.
"""

from __future__ import annotations

import argparse
import base64
import json
import math
import resource
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import parse_corridor
from farfield_core.dispatch.board import Board, Report
from farfield_core.dispatch.celery import CeleryDispatcher
from farfield_core.dispatch.queues import CELLS
from farfield_core.memory import peak_bytes
from farfield_core.scene import Bounds, SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from redis import Redis

from bench.stand import report

SCENE = SceneInfo(
    id="5ce0e0000000c0de",
    name="a plain",
    bounds=Bounds(min=(-1e4, 0.0, -1e4), max=(1e4, 30.0, 1e4)),
    origin=(0.0, 0.0, 0.0),
    triangles=1000,
    vertices=500,
    textures=(),
    batches=(),
    blocks=(),
)


def feed(store: str, broker: str, bake: str) -> None:
    """The feeder's process: ask for progress ten times a second, and say how slow that was."""
    dispatcher = CeleryDispatcher(Store.open(store), broker)
    began = time.monotonic()
    dispatcher.submit(bake)
    submitted = time.monotonic() - began
    slowest = 0.0
    calls = 0
    while True:
        time.sleep(0.1)
        before = time.perf_counter()
        status = dispatcher.status(bake)
        slowest = max(slowest, time.perf_counter() - before)
        calls += 1
        if calls % 100 == 0:
            print(f"{status.done} of {status.total} done", file=sys.stderr, flush=True)
        if status.state == "done":
            break
    dispatcher.close()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    figures = {
        "feeder_megabytes": peak_bytes() / 2**20,
        "feeder_cpu_seconds": usage.ru_utime + usage.ru_stime,
        "submit_seconds": submitted,
        "slowest_progress_ms": 1000 * slowest,
        "progress_calls": calls,
    }
    print(json.dumps(figures), flush=True)


def bake_fast(store: Store, broker: str, bake: str, cells: int) -> dict[str, float]:
    """Take cells from the queue, write and report them; returns what the queue was like."""
    redis: Redis = Redis.from_url(broker)
    board = Board(broker)
    done: set[str] = set()
    longest = 0
    while len(done) < cells:
        waiting: Any = redis.llen(CELLS)
        longest = max(longest, waiting)
        messages: Any = redis.rpop(CELLS, 50) or []
        if not messages:
            time.sleep(0.005)
        for message in messages:
            (_, cell, *_), *_ = json.loads(base64.b64decode(json.loads(message)["body"]))
            store.put_new(f"{layout.cells_prefix(bake)}{cell}.json", b"{}")
            board.report(bake, Report(cell, "bench"))
            done.add(cell)
    board.close()
    redis.close()
    return {"longest_queue": longest, "through_queue": len(done)}


def measure(cells: int, queue: int) -> dict[str, float]:
    """Run it; returns the figures."""
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        broker = f"redis://127.0.0.1:{port}/0"
        options = ["--port", str(port), "--bind", "127.0.0.1", "--save", "", "--dir", folder]
        server = subprocess.Popen(["redis-server", *options], stdout=subprocess.DEVNULL)
        try:
            return _measure(Store.open(Path(folder) / "store"), broker, cells, queue)
        finally:
            server.kill()
            server.wait()


def _measure(store: Store, broker: str, cells: int, queue: int) -> dict[str, float]:
    side = math.ceil(math.sqrt(cells))
    corridor = parse_corridor(
        {"box": {"min": [0, 0, 0], "max": [10 * side, 10, 10 * math.ceil(cells / side)]}}
    )
    began = time.monotonic()
    walk = create_bake(store, SCENE, corridor, BakeSettings(resolution=64, layers=4))
    created = time.monotonic() - began
    began = time.monotonic()
    command = [sys.executable, "-m", "bench.farm", "--feed", store.url, broker, walk.id]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as feeder:
        figures = bake_fast(store, broker, walk.id, min(queue, walk.grid.total))
        through = time.monotonic() - began
        folder = store.local_path(layout.cells_prefix(walk.id))
        assert folder is not None
        for i, j, k in walk_grid(store, walk).indices():
            path = folder / f"{i}_{j}_{k}.json"
            if not path.exists():
                path.touch()
        # the feeder finds the others in the store, and drops what it still had in the queue
        out, _ = feeder.communicate()
    said = json.loads(out.strip().rsplit("\n", 1)[-1])
    with Redis.from_url(broker) as redis:
        commands: Any = redis.info("stats")
    return {
        "cells": walk.grid.total,
        "create_seconds": created,
        **figures,
        "queue_cells_per_second": queue / through,
        "redis_commands": commands["total_commands_processed"],
        "seconds": time.monotonic() - began,
        **said,
    }


def main() -> None:
    """Run the bench."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--queue", type=int, default=20_000)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--feed", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.feed:
        feed(*options.feed)
        return
    report("farm", measure(options.cells, options.queue))


if __name__ == "__main__":
    main()
