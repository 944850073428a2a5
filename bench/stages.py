"""How fast each stage of the bake is, against the paper's plain way, in one run.

    python -m bench.stages [--json] [--keep]

The demo city, 14 m cell, 512 texels, 64 layers, the four side faces, one process on one core.
Rounds of both renderers alternate, so that a noisy machine disturbs both alike; all are medians.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

from bench.stand import city, one_process, report

ROUNDS = 3


def timed(work: Callable[[], object]) -> float:
    """Seconds that `work` takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def figures() -> dict[str, Any]:
    """Seconds a cell of every stage, and pyrender's plain rendering : our whole cell."""
    one_process()
    from farfield_core.faces import SIDES  # noqa: PLC0415 - after the environment is set
    from farfield_core.settings import BakeSettings  # noqa: PLC0415
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415
    from farfield_worker.render import open_renderer  # noqa: PLC0415

    settings = BakeSettings(
        quads="layers", cell_size=(14, 14, 14), layers=64, resolution=512, faces="sides"
    )
    with city(settings) as stand:
        grid = walk_grid(stand.store, stand.walk)
        index = grid.indices()[0]
        centre = grid.centre(index)
        baker = CellBaker(stand.scene, stand.walk, stand.store)
        plain = open_renderer("pyrender", stand.scene)

        def pyrender() -> None:
            for face in SIDES:
                plain.face(centre, face, stand.walk.borders, stand.walk.resolution)

        baker.bake(index, centre)
        pyrender()
        ours, theirs, cells = [], [], []
        for _ in range(ROUNDS):
            cell = baker.bake(index, centre)
            cells.append(cell.figures)
            ours.append(cell.figures["seconds"])
            theirs.append(timed(pyrender))
        plain.close()
        baker.close()
    stages = {
        name: statistics.median(cell[name] for cell in cells)
        for name in cells[0]
        if name.startswith("seconds")
    }
    ratio = statistics.median(b / a for a, b in zip(ours, theirs, strict=True))
    return {
        **stages,
        "pyrender_render_seconds": statistics.median(theirs),
        "pyrender_render_to_whole_cell": ratio,
    }


if __name__ == "__main__":
    report("stages", figures())
