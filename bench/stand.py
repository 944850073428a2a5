"""What all benches stand on: the demo city prepared once, its cells, and how to write figures."""

from __future__ import annotations

import datetime
import json
import os
import platform
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from farfield_core.bake import create_bake
from farfield_core.corridor import read_corridor
from farfield_core.scene import PreparedScene
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.walk import Walk
from farfield_worker.demo import AVENUE

RESULTS = Path(__file__).parent / "results"


class Stand(NamedTuple):
    """A store with a prepared scene, and the manifest of a bake that has no cells yet."""

    store: Store
    scene: PreparedScene
    walk: Walk


@contextmanager
def city(settings: BakeSettings, triangles: int = 850_000) -> Iterator[Stand]:
    """The demo city and its corridor under `settings`, in a folder that goes away."""
    from farfield.target import prepared_scene  # noqa: PLC0415 - after the environment is set
    from farfield_worker.demo.city import write_city  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        model = Path(folder) / "city.glb"
        write_city(model, triangles=triangles)
        store = Store.open(str(Path(folder) / "store"))
        info = prepared_scene(store, str(model))
        walk = create_bake(store, info, read_corridor(AVENUE), settings)
        yield Stand(store, open_prepared(store, info.id), walk)


def one_process() -> None:
    """Measure one process on one core: no threads of the software rasteriser or of Numba."""
    os.environ["LP_NUM_THREADS"] = "0"
    os.environ["NUMBA_NUM_THREADS"] = "1"


def machine() -> dict[str, str]:
    """What the figures were measured on, and when."""
    return {
        "date": datetime.date.today().isoformat(),
        "python": platform.python_version(),
        "processor": platform.machine(),
        "cores": str(os.cpu_count()),
    }


def report(name: str, figures: dict[str, Any]) -> None:
    """Print the figures: one JSON object with --json, else a line each; --keep writes them too."""
    figures = {**figures, "machine": machine()}
    if "--keep" in sys.argv:
        RESULTS.mkdir(exist_ok=True)
        text = json.dumps(figures, indent=1)
        (RESULTS / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    if "--json" in sys.argv:
        print(json.dumps(figures))
        return
    for key, value in figures.items():
        print(f"{key:32} {value}")
