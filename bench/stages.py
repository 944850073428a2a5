"""How fast each stage of the bake is, against the paper's plain way, in one run.

    python -m bench.stages [--json] [--keep]

The demo city, 14 m cell, 512 texels, 64 layers, the four side faces, one process on one core.
Rounds of both renderers alternate, so that a noisy machine disturbs both alike; all are medians.
Stages are seconds of the clock; totals and ratios are of processor seconds, which other work on the
machine disturbs less.
"""

from __future__ import annotations

import io
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from farfield_core.walk import CellFile
from PIL import Image

from bench.stand import city, one_process, report

ROUNDS = 3


def timed(work: Callable[[], object]) -> float:
    """Processor seconds that `work` takes; one process on one core needs no more of the clock."""
    start = time.process_time()
    work()
    return time.process_time() - start


def encoders(files: list[bytes]) -> dict[str, float]:
    """Kilobytes and processor seconds of a cell's atlas pages, PNG files, with every encoder."""
    from farfield_worker.compile.encode import ENCODERS  # noqa: PLC0415

    pages = [np.asarray(Image.open(io.BytesIO(file))) for file in files]
    out = {}
    for name, (_, encode) in ENCODERS.items():
        coded = [encode(page) for page in pages]
        seconds = [timed(partial(list, map(encode, pages))) for _ in range(ROUNDS)]
        out[f"{name}_kilobytes"] = sum(map(len, coded)) / 1024
        out[f"{name}_processor_seconds"] = statistics.median(seconds)
    return out


def figures() -> dict[str, Any]:
    """Seconds a cell of every stage, and pyrender's plain rendering : our whole cell."""
    one_process()
    from farfield_core.bake import create_bake  # noqa: PLC0415 - after the environment is set
    from farfield_core.corridor import read_corridor  # noqa: PLC0415
    from farfield_core.faces import SIDES  # noqa: PLC0415
    from farfield_core.settings import BakeSettings  # noqa: PLC0415
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415
    from farfield_worker.demo import AVENUE  # noqa: PLC0415
    from farfield_worker.render import open_renderer  # noqa: PLC0415

    settings = BakeSettings(
        quads="layers", cell_size=(14, 14, 14), layers=64, resolution=512, faces="sides"
    )
    with city(settings) as stand:
        grid = walk_grid(stand.store, stand.walk)
        index = grid.indices()[0]
        centre = grid.centre(index)
        baker = CellBaker(stand.scene, stand.walk, stand.store)
        # What the paper's cell is: what nobody can see is in it, too.
        blind = settings.model_copy(update={"visibility": "off"})
        bake = create_bake(stand.store, stand.scene.info, read_corridor(AVENUE), blind)
        simple = CellBaker(stand.scene, bake, stand.store)
        plain = open_renderer("pyrender", stand.scene)

        def pyrender() -> None:
            for face in SIDES:
                plain.face(centre, face, stand.walk.borders, stand.walk.resolution)

        baker.bake(index, centre)
        simple.bake(index, centre)
        pyrender()
        ours: list[float] = []
        without: list[float] = []
        theirs: list[float] = []
        cells: list[CellFile] = []
        for _ in range(ROUNDS):
            ours.append(timed(lambda: cells.append(baker.bake(index, centre))))
            without.append(timed(lambda: simple.bake(index, centre)))
            theirs.append(timed(pyrender))
        plain.close()
        simple.close()
        baker.close()
        pages = [stand.store.get(f"blobs/atlases/{name}") for name in cells[0].atlases]
    stages = {
        name: statistics.median(cell.figures[name] for cell in cells)
        for name in cells[0].figures
        if name.startswith("seconds")
    }

    def slower(times: list[float]) -> float:
        """Pyrender's time in parts of ours, round by round."""
        return statistics.median(b / a for a, b in zip(times, theirs, strict=True))

    return {
        **stages,
        "processor_seconds": statistics.median(ours),
        **encoders(pages),
        "pyrender_render_seconds": statistics.median(theirs),
        "processor_seconds_visibility_off": statistics.median(without),
        "pyrender_render_to_whole_cell": slower(ours),
        "pyrender_render_to_whole_cell_visibility_off": slower(without),
    }


if __name__ == "__main__":
    report("stages", figures())
