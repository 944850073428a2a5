"""What the near field costs, and what no eye can see (docs/near-field.md).

    python -m bench.near [--json] [--keep] [--quick] [scene ...]

Cells of real scenes, baked with visibility on and off in one run, one process on one core:

- differ: share of pixels that are not equal in pictures of the two walks from random eyes in the
  cell, in random directions, drawn from their files; for slanted quads, whose planes differ with
  what is left out, share that is missing on one side only;
- near triangles and far texels listed and stored, on : off, and near triangles against what 1,000
  random eyes see in maps as fine as a face;
- seconds that visibility adds to a cell, on : off, processor time of neighbouring cells in turn;
- pixels at the near border, seen from the cell's corners, and cracks among them;
- bytes of near geometry that a step into the next cell fetches, against the whole cell's.

--quick takes a fifth of the eyes and a quarter of the cells.
"""

from __future__ import annotations

import itertools
import math
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import Corridor, read_corridor
from farfield_core.ground import ground_under
from farfield_core.scene import PreparedScene
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from farfield_core.walk import CellFile, Walk
from numpy.typing import NDArray

from bench.stand import one_process, report
from tests.corridors.scenes import SCENES

#: scenes measured if none are named, with the number of cells that times are averaged over
DEFAULT = {"medieval_town_2M": 24, "hotel_room": 4, "pandora": 4}
QUICK = "--quick" in sys.argv
EYES, WITNESSES = (40, 200) if QUICK else (200, 1000)
#: pixels across a picture
SIZE = 512


class Pair(NamedTuple):
    """The same cells with visibility on and off."""

    on: Walk
    off: Walk
    cells: dict[bool, list[CellFile]]
    seconds: dict[bool, list[float]]


@contextmanager
def prepared(name: str) -> Iterator[tuple[Store, PreparedScene]]:
    """One of the real scenes, prepared in a store that goes away."""
    from farfield.target import prepared_scene  # noqa: PLC0415 - after the environment is set

    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        store = Store.open(folder)
        info = prepared_scene(store, str(SCENES[name].model))
        yield store, open_prepared(store, info.id)


def corridor_of(name: str, cells: int) -> Corridor:
    """The scene's corridor, in its direction, for about that many cells: three abreast from 12."""
    corridor = read_corridor(SCENES[name].corridor)
    assert corridor.path is not None
    edge = SCENES[name].cell_size
    first, second = np.array(corridor.path.points)
    abreast = 3 if cells >= 12 else 1
    length = (cells / abreast - 0.6) * edge
    along = (second - first) * length / math.dist(first, second)
    path = corridor.path.model_copy(
        update={
            "points": (tuple(first.tolist()), tuple((first + along).tolist())),
            "width": 1.2 * edge if abreast == 3 else 0.1 * edge,
        }
    )
    return corridor.model_copy(update={"path": path})


def bake(store: Store, scene: PreparedScene, name: str, cells: int, **settings: Any) -> Pair:
    """Bake the first cells of the scene's corridor both ways, in turn."""
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415

    corridor = corridor_of(name, cells)
    edge = SCENES[name].cell_size
    ground = ground_under(scene, corridor)
    walks, bakers = {}, {}
    for on in (True, False):
        chosen = BakeSettings(
            cell_size=(edge, edge, edge), visibility="on" if on else "off", **settings
        )
        walks[on] = create_bake(store, scene.info, corridor, chosen, ground=ground)
        bakers[on] = CellBaker(scene, walks[on], store)
    grid = walk_grid(store, walks[True])
    indices = grid.indices()[:cells]
    out: dict[bool, list[CellFile]] = {True: [], False: []}
    spent: dict[bool, list[float]] = {True: [], False: []}
    for baker in bakers.values():
        baker.bake(indices[0], grid.centre(indices[0]))  # compiles
    for index in indices:
        for on in (True, False):
            start = time.process_time()
            out[on].append(bakers[on].bake(index, grid.centre(index)))
            spent[on].append(time.process_time() - start)
    for baker in bakers.values():
        baker.close()
    return Pair(walks[True], walks[False], out, spent)


def local(store: Store, key: str) -> Path:
    """The file of an object in a store that is a folder."""
    path = store.local_path(key)
    assert path is not None
    return path


def random_views(cell: CellFile, half: NDArray[np.float64], number: int) -> Iterator[Any]:
    """Views from eyes anywhere in the cell, looking anywhere, the same ones every time."""
    from farfield_worker.shoot.view import View  # noqa: PLC0415

    rng = np.random.default_rng(2002)
    for _ in range(number):
        x, y, z = np.array(cell.eyes[0]) + half * rng.uniform(-1, 1, 3)
        yaw, pitch = rng.uniform(-math.pi, math.pi), math.asin(rng.uniform(-1, 1))
        yield View((float(x), float(y), float(z)), yaw, pitch, 60.0, SIZE)


def differing(store: Store, pair: Pair, number: int, views: int) -> dict[str, float]:
    """Shares of pixels that differ between the two walks, in views from one cell."""
    from farfield_worker.shoot.walk import WalkShooter  # noqa: PLC0415
    from farfield_worker.verify.metrics import eroded, unmatched  # noqa: PLC0415

    cell = pair.cells[True][number]
    shooters = [WalkShooter(local(store, layout.walk_key(w.id))) for w in (pair.on, pair.off)]
    half = np.array(pair.on.grid.size) / 2
    shares = []
    for view in random_views(cell, half, views):
        on, off = (shooter.shoot(view, cell.cell) for shooter in shooters)
        there = [picture.rgba[..., 3] > 0 for picture in (on, off)]
        shares.append(
            (
                np.any(on.rgba != off.rgba, axis=-1).mean(),
                unmatched(off.rgba[..., :3], on.rgba[..., :3]).mean(),
                (eroded(there[1]) & ~there[0]).mean(),
                (there[1] & ~there[0]).mean(),
            )
        )
    for shooter in shooters:
        shooter.close()
    names = ("differ", "wrong", "missing", "sky")
    out = dict(zip(names, np.mean(shares, axis=0).tolist(), strict=True))
    return out | {"differ_worst": float(np.max(shares, axis=0)[0])}


def witnessed(scene: PreparedScene, walk: Walk, centre: NDArray[np.float64], eyes: int) -> int:
    """Near triangles that random eyes see, in maps as fine as a face."""
    from farfield_worker.visibility.near_maps import NearMapRenderer  # noqa: PLC0415

    renderer = NearMapRenderer(scene, walk.resolution)
    renderer.enter(centre, walk.near_drawn)
    half = np.array(walk.grid.size) / 2
    rng = np.random.default_rng(1000)
    seen = np.zeros(scene.info.triangles + 1, np.bool_)
    for _ in range(eyes):
        eye = centre + half * rng.uniform(-1, 1, 3)
        for face in range(6):
            seen[renderer.map(eye, face).triangle.reshape(-1)] = True
    renderer.close()
    return int(seen[:-1].sum())


def cracks(store: Store, scene: PreparedScene, walk: Walk, cell: CellFile) -> dict[str, int]:
    """Pixels at the near border seen from a cell's corners, and those that show background."""
    from farfield_worker.shoot.scene import SceneShooter  # noqa: PLC0415
    from farfield_worker.shoot.view import NearField, View  # noqa: PLC0415
    from farfield_worker.shoot.walk import WalkShooter  # noqa: PLC0415
    from farfield_worker.verify.border import border  # noqa: PLC0415

    walks, scenes = WalkShooter(local(store, layout.walk_key(walk.id))), SceneShooter(scene)
    half = np.array(walk.grid.size) / 2
    found = np.zeros(2, np.int64)
    for n, corner in enumerate(itertools.product((-1, 1), repeat=3)):
        x, y, z = (np.array(cell.eyes[0]) + half * corner).tolist()
        view = View((x, y, z), n * math.pi / 4, -0.2, 60.0, SIZE, 0.01 * min(walk.grid.size))
        geometry = walks.shoot(view, cell.cell).rgba[..., 3] > 0
        seen = border(scenes, view, NearField(cell.eyes[0], walk.near_field), geometry)
        found += [int(seen.pixels.sum()), int(seen.cracks.sum())]
    walks.close()
    scenes.close()
    return {"border_pixels": int(found[0]), "border_cracks": int(found[1])}


def near_bytes(store: Store, cell: CellFile) -> dict[str, int]:
    """Bytes of each file of near geometry that a cell needs."""
    return {part.blob: store.size(layout.near_key(part.blob)) or 0 for part in cell.near}


def measure(name: str, cells: int, settings: dict[str, Any]) -> dict[str, Any]:
    """All figures of one scene under `settings`: sums over `cells` cells, pictures of the first."""
    with prepared(name) as (store, scene):
        pair = bake(store, scene, name, cells, **settings)
        on, off = pair.cells[True], pair.cells[False]
        total = {
            key: [sum(cell.figures[key] for cell in cells) for cells in (on, off)]
            for key in ("near_triangles", "texels", "quads", "atlas_bytes")
        }
        sizes = [near_bytes(store, cell) for cell in on]
        steps = [
            sum(size for blob, size in after.items() if blob not in before) / sum(after.values())
            for before, after in itertools.pairwise(sizes)
            if after
        ]
        # both kinds of quads have the same near field
        witnesses = 0
        if settings["quads"] == "layers":
            witnesses = witnessed(scene, pair.on, np.array(on[0].eyes[0]), WITNESSES)
        return {
            "near_field": pair.on.near_field,
            **differing(store, pair, 0, EYES),
            **{f"{key}_on_off": a / max(b, 1) for key, (a, b) in total.items()},
            "near_triangles": on[0].figures["near_triangles"],
            "near_triangles_off": off[0].figures["near_triangles"],
            "near_triangles_witnessed": witnesses,
            "texels": on[0].figures["texels"],
            "eyes": on[0].figures["eyes"],
            "seconds_added": sum(pair.seconds[True]) / sum(pair.seconds[False]) - 1,
            "cells": len(on),
            "random_eyes": EYES,
            "witnesses": WITNESSES,
            **cracks(store, scene, pair.on, on[0]),
            "seconds": float(np.mean(pair.seconds[True])),
            "seconds_off": float(np.mean(pair.seconds[False])),
            "near_kilobytes": float(np.mean([sum(s.values()) for s in sizes])) / 1024,
            "step_bytes": float(np.mean(steps)) if steps else 0.0,
        }


def figures() -> dict[str, Any]:
    """Figures by scene and kind of quads."""
    one_process()
    names = [word for word in sys.argv[1:] if not word.startswith("-")] or list(DEFAULT)
    out = {}
    for quads in ("layers", "slanted"):
        for name in names:
            cells = DEFAULT.get(name, 2) if quads == "layers" else 2
            found = measure(name, max(cells // 4, 2) if QUICK else cells, {"quads": quads})
            out[f"{name} {quads}"] = found
            print(name, quads, found, file=sys.stderr, flush=True)
    return out


if __name__ == "__main__":
    report("near", figures())
