"""Cells a second of as many processes as there are cores, against one process.

    python -m bench.cores [--json] [--keep]

The demo city, 14 m cell, 512 texels, 64 layers, the four side faces. Every process bakes the same
cells after one to warm up, all start together, and rounds of one and of many processes alternate.
"""

from __future__ import annotations

import multiprocessing
import os
import statistics
import time
from multiprocessing.synchronize import Barrier
from typing import Any

from bench.stand import city, one_process, report

CELLS = 5
ROUNDS = 2


class Nowhere:
    """Keeps no file, so that nothing is there already."""

    def put_new(self, key: str, data: bytes) -> bool:
        """Forget an object."""
        return True


def bake(store_url: str, walk_id: str, begin: Barrier, end: Barrier) -> None:
    """Bake `CELLS` cells between `begin` and `end`."""
    from farfield_core import layout  # noqa: PLC0415 - after the environment is set
    from farfield_core.scenes import open_prepared  # noqa: PLC0415
    from farfield_core.store import Store  # noqa: PLC0415
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_core.walk import Walk  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415

    store = Store.open(store_url)
    walk = Walk.model_validate_json(store.get(layout.walk_key(walk_id)))
    grid = walk_grid(store, walk)
    baker = CellBaker(open_prepared(store, walk.scene.id), walk, Nowhere())
    indices = grid.indices()[: CELLS + 1]
    baker.bake(indices[0], grid.centre(indices[0]))
    begin.wait()
    for index in indices[1:]:
        baker.bake(index, grid.centre(index))
    end.wait()
    baker.close()


def seconds(store_url: str, walk_id: str, processes: int) -> float:
    """Seconds until each of `processes` has baked its cells."""
    spawn = multiprocessing.get_context("spawn")
    begin, end = spawn.Barrier(processes + 1), spawn.Barrier(processes + 1)
    workers = [
        spawn.Process(target=bake, args=(store_url, walk_id, begin, end), daemon=True)
        for _ in range(processes)
    ]
    for worker in workers:
        worker.start()
    begin.wait(300)
    start = time.perf_counter()
    end.wait(300)
    taken = time.perf_counter() - start
    for worker in workers:
        worker.join()
    return taken


def figures() -> dict[str, Any]:
    """Cells a second with one process and with one a core, and their ratio; medians of rounds."""
    one_process()
    from farfield_core.settings import BakeSettings  # noqa: PLC0415 - after the environment is set

    many = os.cpu_count() or 1
    settings = BakeSettings(
        quads="layers", cell_size=(14, 14, 14), layers=64, resolution=512, faces="sides"
    )
    with city(settings) as stand:
        rounds = [
            [seconds(stand.store.url, stand.walk.id, n) for n in (1, many)] for _ in range(ROUNDS)
        ]
    return {
        "processes": many,
        "cells_a_second_one": statistics.median(CELLS / one for one, _ in rounds),
        "cells_a_second_all": statistics.median(many * CELLS / all_ for _, all_ in rounds),
        "all_to_one": statistics.median(many * one / all_ for one, all_ in rounds),
    }


if __name__ == "__main__":
    report("cores", figures())
