"""How good layers and slanted quads are on one scene, against full renders, in parts of the floor.

    python -m bench.quality [SCENE] [--quads layers|slanted] [--json] [--keep]

SCENE is a name of tests/corridors/scenes.py, the demo city unless given. Two neighbouring cells of
its corridor are baked with 64 layers (or the near border that so many have), 512 texels and the
four side faces, in rooms all six, and compared by `farfield verify` in 48 views of 512 pixels.
`fine_faces` is the same with faces of 1024 texels at the same bound, seen at 512 pixels.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from farfield.target import prepared_scene
from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import Corridor, read_corridor
from farfield_core.placement import default_alpha
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from farfield_worker.cell.bake import CellBaker
from farfield_worker.demo.city import write_city
from farfield_worker.verify.report import verify

from bench.stand import report
from tests.corridors.scenes import SCENES, Scene

VIEWS, PIXELS = 24, 512


def figures(name: str, quads: str) -> dict[str, Any]:
    """Figures of both resolutions; see the head."""
    scene = SCENES[name]
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        model = Path(folder) / "city.glb"
        if scene.source is None:
            write_city(model, triangles=850_000)
        else:
            model = scene.model
        store = Store.open(str(Path(folder) / "store"))
        info = prepared_scene(store, str(model))
        settings = BakeSettings.model_validate(
            {
                "quads": quads,
                "cell_size": (scene.cell_size,) * 3,
                "layers": 64,
                "resolution": PIXELS,
                "faces": scene.faces,
            }
        )
        bound = default_alpha(PIXELS)
        fine = settings.model_copy(update={"resolution": 2 * PIXELS, "alpha": bound})
        return {
            "scene": name,
            "quads": quads,
            "paper": look(store, info.id, scene, settings),
            "fine_faces": look(store, info.id, scene, fine),
        }


def corridor(scene: Scene) -> Corridor:
    """The first cell of the scene's corridor, and the one east of it."""
    whole = read_corridor(scene.corridor)
    path = whole.path
    assert path is not None
    x, y, z = path.points[0]
    points = ((x, y, z), (x + 0.8 * scene.cell_size, y, z))
    path = path.model_copy(update={"points": points, "width": 0.01 * scene.cell_size})
    return whole.model_copy(update={"path": path})


def look(store: Store, scene_id: str, scene: Scene, settings: BakeSettings) -> dict[str, Any]:
    """Bake the cells, verify them, and say what they come to."""
    prepared = open_prepared(store, scene_id)
    walk = create_bake(store, prepared.info, corridor(scene), settings)
    grid = walk_grid(store, walk)
    baker = CellBaker(prepared, walk, store)
    cells = [baker.bake(index, grid.centre(index)) for index in grid.indices()]
    baker.close()
    folder = store.local_path(layout.bake_prefix(walk.id))
    assert folder is not None
    overall = verify(folder, VIEWS, pixels=PIXELS)[0]["overall"]
    floor, corners = overall["floor"], overall["corners"]
    return {
        "cells": len(cells),
        "quads": sum(len(cell.quads.faces) for cell in cells) / len(cells),
        "png_kilobytes": sum(cell.figures["atlas_bytes"] for cell in cells) / len(cells) / 1000,
        "wrong": overall["wrong"],
        "wrong_to_floor": overall["wrong"] / floor["wrong"],
        "missing": overall["missing"],
        "extra": overall["extra"],
        "flip_to_floor": overall["flip"] / floor["flip"],
        "flip_at_corners_to_floor": corners["flip"] / corners["floor"]["flip"],
        "pop_to_floor": overall["pop"] / floor["pop"],
    }


def main() -> None:
    """Run the bench."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    quads = "layers"
    if "--quads" in sys.argv:
        quads = sys.argv[sys.argv.index("--quads") + 1]
        words.remove(quads)
    name = words[0] if words else "city"
    report(f"quality_{quads}_{name}", figures(name, quads))


if __name__ == "__main__":
    main()
