"""Slanted quads against the paper's layers on one scene, at the same bound and near borders.

    python -m bench.slanted [SCENE] [--close] [--json] [--keep]

SCENE is a name of tests/corridors/scenes.py, the demo city unless given. Up to four neighbouring
cells of its corridor are baked in each way, in turn, in one process on one core, with the near
border that 64 layers have, or with `--close` one four times closer, but outside the cell by a tenth
of its size. `seconds` are the mean processor time of all cells but the first, which warms up; all
other figures are of the second cell, pictures from its centre, corners and random eyes.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench.stand import one_process, report

VIEWS = 12
CELLS = 4
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
        "layers, visibility off": layers.model_copy(update={"visibility": "off"}),
        "layers, greedy": layers.model_copy(update={"grower": "greedy"}),
    }
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        model = Path(folder) / "city.glb"
        if scene.source is None:
            write_city(model, triangles=850_000)
        else:
            model = scene.model
        store = Store.open(str(Path(folder) / "store"))
        info = prepared_scene(store, str(model))
        table = _kinds(store, info.id, scene.corridor, kinds)
        for kind, settings in kinds.items():
            bake, cell = table[kind].pop("bake"), table[kind].pop("cell")
            if settings.grower == "best":
                table[kind] |= _pictures(Path(folder) / "store" / "bakes" / bake, cell)
    return {
        "scene": name,
        "cell_size": scene.cell_size,
        "near": near,
        "layers": len(layers.place().layers),
        **table,
    }


def _kinds(
    store: Any, scene: str, corridor: Path, kinds: dict[str, Any]
) -> dict[str, dict[str, Any]]:
    """Bake cells in every way, cell by cell; counts of the second and mean processor time."""
    from farfield_core import scenes  # noqa: PLC0415 - after the environment is set
    from farfield_core.bake import create_bake  # noqa: PLC0415
    from farfield_core.corridor import read_corridor  # noqa: PLC0415
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415

    info, prepared = scenes.scene_info(store, scene), scenes.open_prepared(store, scene)
    walks = {
        kind: create_bake(store, info, read_corridor(corridor), settings)
        for kind, settings in kinds.items()
    }
    bakers = {kind: CellBaker(prepared, walk, store) for kind, walk in walks.items()}
    table: dict[str, dict[str, Any]] = {kind: {"bake": walk.id} for kind, walk in walks.items()}
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    grid = walk_grid(store, walks["slanted"])
    for number, index in enumerate(grid.indices()[:CELLS]):
        for kind, baker in bakers.items():
            start = time.process_time()
            cell = baker.bake(index, grid.centre(index))
            seconds[kind].append(time.process_time() - start)
            if number == 1:
                table[kind]["cell"] = cell
                table[kind] |= {name: round(cell.figures[name]) for name in COUNTS}
    for kind, baker in bakers.items():
        baker.close()
        table[kind]["seconds"] = round(statistics.mean(seconds[kind][1:]), 2)
    return table


def _pictures(bake: Path, cell: Any) -> dict[str, Any]:
    """How a `cell` of a bake compares with full renders."""
    from farfield_worker.verify.report import Tally, Verifier  # noqa: PLC0415

    verifier = Verifier(bake)
    tally = Tally()
    for part, _ in verifier.compare(cell, VIEWS):
        tally.add(part)
    verifier.close()
    shown = tally.json()
    found: dict[str, Any] = {key: shown[key] for key in PICTURES}
    return {**found, "floor": {key: shown["floor"][key] for key in PICTURES}}


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if not word.startswith("--")]
    chosen, nearer = names[0] if names else "city", "--close" in sys.argv
    report(f"slanted_{chosen}{'_close' if nearer else ''}", figures(chosen, nearer))
