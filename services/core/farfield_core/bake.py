"""A bake: one scene, corridor and settings, turned into a manifest whose cells are then baked.

The bake's id is a hash of all it depends on, and everything is written create-only, so asking for
the same bake again finds the first one: running again is resuming.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator

from farfield_shading import default_light

from farfield_core import layout, near_border
from farfield_core import walk as walk_format
from farfield_core.cells import CellGrid, Index, parse_cell_name
from farfield_core.choice import choose
from farfield_core.corridor import Corridor, Ground, cut
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.ground import ground_under
from farfield_core.placement import Placement
from farfield_core.scene import SceneInfo
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import cell_table_pages, walk_grid
from farfield_core.validation import parse
from farfield_core.walk import AtlasFormat, Places, Start, Walk, WalkScene

#: atlas pages are squares of this many pixels; larger microtextures are split into rectangles
ATLAS_SIZE = 1024


def bake_id(scene: str, corridor: Corridor, settings: BakeSettings) -> str:
    """Hash of everything that decides what a bake contains, 16 hex digits."""
    parts = [walk_format.VERSION, scene, corridor.model_dump(mode="json"), settings.key()]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def create_bake(
    store: Store,
    scene: SceneInfo,
    corridor: Corridor,
    settings: BakeSettings,
    ground: Ground | None = None,
    follows: str | None = None,
) -> Walk:
    """Write the manifest of a bake, or find the one written before.

    Corridors that follow the ground ask `ground`, which is the prepared scene's own unless given.
    Settings with a budget, or without a near border, stand for those that they lead to.
    Cells of the bake `follows`, of the scene before an edit, are carried over where the edit does
    not show. Raises NotFoundError where there is no such bake, and BadInputError where corridor and
    settings do not go together.
    """
    before = read_walk(store, follows) if follows is not None else None
    if before is not None and near_border.is_open(settings):
        # or no cell could be carried over
        settings = settings.model_copy(update={"near": before.near_field})
    settings = choose(scene, corridor, settings).settings
    identity = bake_id(scene.id, corridor, settings)
    if follows is not None and follows != identity:
        store.put(layout.predecessor_key(identity), json.dumps({"bake": follows}).encode())
    if store.exists(layout.walk_key(identity)):
        return read_walk(store, identity)
    if corridor.follow_ground and ground is None:
        ground = ground_under(open_prepared(store, scene.id), corridor)
    grid = cut(corridor, settings.cell_size, ground)
    tables = cell_table_pages(grid)
    placement = settings.place() if settings.quads == "layers" else Placement((), ())
    walk = Walk(
        id=identity,
        name=scene.name,
        scene=WalkScene(
            id=scene.id, name=scene.name, triangles=scene.triangles, bounds=scene.bounds
        ),
        settings=settings.model_dump(mode="json"),
        resolution=settings.resolution,
        layers=placement.layers,
        borders=placement.borders,
        near_field=settings.near_field,
        grid=tables.grid,
        atlas=AtlasFormat(width=ATLAS_SIZE, height=ATLAS_SIZE, encoding=settings.encoder),
        light={name: (c[0], c[1], c[2]) for name, c in default_light().items()},
        start=_start(corridor, grid),
    )
    for href, page in tables.pages.items():
        store.put_new(layout.bake_prefix(identity) + href, page.model_dump_json().encode())
    # last: whoever sees the manifest finds its pages
    if not store.put_new(layout.walk_key(identity), walk.model_dump_json().encode()):
        return read_walk(store, identity)
    return walk


def read_walk(store: Store, bake: str) -> Walk:
    """The manifest of a bake; raises NotFoundError."""
    return parse(Walk, store.get(layout.walk_key(bake)), f"The manifest of bake {bake}")


def predecessor(store: Store, bake: str) -> str | None:
    """The bake that a bake follows, None where it stands alone."""
    try:
        return str(json.loads(store.get(layout.predecessor_key(bake)))["bake"])
    except NotFoundError:
        return None


def settings_of(walk: Walk) -> BakeSettings:
    """The settings that a walk was baked with."""
    return parse(BakeSettings, walk.settings, f"The settings of bake {walk.id}")


def relocate(walk: Walk, places: Places) -> Walk:
    """The same walk with its cells, atlases and near blocks elsewhere, relative to its manifest.

    Raises BadInputError where a place is not a folder ending in a slash.
    """
    for name, place in places.model_dump().items():
        if not place.endswith("/"):
            raise BadInputError(f"The place of {name}, {place!r}, has to end in a slash.")
    return walk.model_copy(update={"places": places})


def done_names(store: Store, bake: str) -> Iterator[str]:
    """Names of a bake's cells that exist, one after the other."""
    prefix = layout.cells_prefix(bake)
    for key in store.list(prefix):
        name, dot, suffix = key.removeprefix(prefix).partition(".")
        if dot and suffix == "json":
            yield name


def done_cells(store: Store, bake: str) -> set[Index]:
    """Cells of a bake that exist."""
    return {parse_cell_name(name) for name in done_names(store, bake)}


def missing_cells(store: Store, walk: Walk) -> list[Index]:
    """Cells of a walk that do not exist yet, in baking order."""
    done = done_cells(store, walk.id)
    return [index for index in walk_grid(store, walk).indices() if index not in done]


def _start(corridor: Corridor, grid: CellGrid) -> Start:
    """In the middle of the first cell, looking along the corridor."""
    dx, dz = _heading(corridor)
    x, y, z = grid.centre(grid.indices()[0])
    return Start(eye=(float(x), float(y), float(z)), yaw=math.atan2(-dx, -dz), pitch=0.0)


def _heading(corridor: Corridor) -> tuple[float, float]:
    """Where a walker who enters the corridor looks, (x, z)."""
    if corridor.box is not None:
        x, _, z = (b - a for a, b in zip(corridor.box.min, corridor.box.max, strict=True))
        return (1.0, 0.0) if x >= z else (0.0, 1.0)
    assert corridor.path is not None
    first = corridor.path.points[0]
    for point in corridor.path.points:
        dx, dz = point[0] - first[0], point[2] - first[2]
        if math.hypot(dx, dz) > 0:
            return dx, dz
    return 0.0, -1.0
