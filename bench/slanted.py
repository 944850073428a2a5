"""Slanted quads against the paper's layers on one scene, at the same bound and near borders.

    python -m bench.slanted [SCENE] [--close] [--json] [--keep]

SCENE is a name of tests/corridors/scenes.py, the demo city unless given. Two neighbouring cells of
its corridor are baked both ways in one process on one core, with the near border that 64 layers
have, or with `--close` one four times closer, but outside the cell by a tenth of its size. All
figures are of the second cell, `seconds` its processor time, pictures from random eyes.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench.stand import one_process, report

VIEWS = 4
PICTURES = ("wrong", "missing", "extra", "flip")
COUNTS = ("quads", "atlas_bytes", "near_triangles", "peak_megabytes")


def figures(name: str, close: bool) -> dict[str, Any]:
    """Figures by kind of quads."""
    one_process()
    from farfield.target import prepared_scene  # noqa: PLC0415 - after the environment is set
    from farfield_core.settings import BakeSettings  # noqa: PLC0415
    from farfield_core.store import Store  # noqa: PLC0415
    from farfield_worker.demo.city import write_city  # noqa: PLC0415

    from tests.corridors.scenes import SCENES  # noqa: PLC0415

    scene = SCENES[name]
    size = (scene.cell_size,) * 3
    far = BakeSettings(quads="layers", cell_size=size, layers=64).near_field
    border = max(far / 4, 0.6 * scene.cell_size) if close else far
    # slanted quads start where the layers do that come nearest to the border asked for
    layers = BakeSettings(quads="layers", cell_size=size, near=border + 1e-6)
    near = layers.near_field
    kinds = {
        "slanted": BakeSettings(cell_size=size, near=near),
        "layers": layers,
        "layers, greedy": layers.model_copy(update={"grower": "greedy"}),
    }
    table = {}
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        model = Path(folder) / "city.glb"
        if scene.source is None:
            write_city(model, triangles=850_000)
        else:
            model = scene.model
        store = Store.open(str(Path(folder) / "store"))
        info = prepared_scene(store, str(model))
        for kind, settings in kinds.items():
            table[kind] = _cell(Path(folder), store, info.id, scene.corridor, settings)
    return {
        "scene": name,
        "cell_size": scene.cell_size,
        "near": near,
        "layers": len(layers.place().layers),
        **table,
    }


def _cell(folder: Path, store: Any, scene: str, corridor: Path, settings: Any) -> dict[str, Any]:
    """Bake two cells and compare the second with full renders."""
    from farfield_core import scenes  # noqa: PLC0415 - after the environment is set
    from farfield_core.bake import create_bake  # noqa: PLC0415
    from farfield_core.corridor import read_corridor  # noqa: PLC0415
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415
    from farfield_worker.verify.report import Tally, Verifier  # noqa: PLC0415

    walk = create_bake(store, scenes.scene_info(store, scene), read_corridor(corridor), settings)
    grid = walk_grid(store, walk)
    first, second = grid.indices()[:2]
    baker = CellBaker(scenes.open_prepared(store, scene), walk, store)
    baker.bake(first, grid.centre(first))
    start = time.process_time()
    cell = baker.bake(second, grid.centre(second))
    seconds = time.process_time() - start
    baker.close()
    found: dict[str, Any] = {name: round(cell.figures[name]) for name in COUNTS}
    found["seconds"] = round(seconds, 2)
    if settings.grower == "best":
        bake = folder / "store" / "bakes" / walk.id
        verifier = Verifier(bake)
        tally = Tally()
        for part, _ in verifier.compare(cell, VIEWS):
            tally.add(part)
        verifier.close()
        shown = tally.json()
        found |= {key: shown[key] for key in PICTURES}
        found["floor"] = {key: shown["floor"][key] for key in PICTURES}
        shutil.rmtree(bake)
    return found


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if not word.startswith("--")]
    chosen, nearer = names[0] if names else "city", "--close" in sys.argv
    report(f"slanted_{chosen}{'_close' if nearer else ''}", figures(chosen, nearer))
