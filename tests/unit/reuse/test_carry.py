"""An edit of a scene, and the cells of a bake that it leaves as they are."""

import io
import itertools
import json
import os

import numpy as np
import pytest
from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import Box, Corridor
from farfield_core.errors import NotFoundError
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from farfield_core.validation import parse
from farfield_core.walk import CellFile
from farfield_worker.cell.command import serve
from farfield_worker.reuse.changes import changes

from tests.unit.raycast import cast
from tests.unit.scenes import SceneWriter

pytestmark = pytest.mark.usefixtures("graphics")

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
#: cells along the street
CELLS = 100 if SOAK else 7
LONG = 4.0 * CELLS
SETTINGS = {"cell_size": 4, "near": 8.0, "resolution": 128 if SOAK else 64}


def street(folder, house=(0.0, 6.0), floor=(0.3, 0.3, 0.3, 1)):
    """A street between two high walls, a gap in one of them, and behind the gap a house.

    `house` is where along the street, and how high, it is; None leaves it out.
    """
    writer = SceneWriter()
    batch = writer.batch(double_sided=True)
    corners = [[-300, 0, 300], [300 + LONG, 0, 300], [300 + LONG, 0, -300], [-300, 0, -300]]
    writer.quad(batch, corners, color=floor)
    for x in np.arange(-40, LONG + 40, 8.0):
        writer.box(batch, (x, 0, 12), (x + 8, 40, 14), color=(0.7, 0.2, 0.2, 1))
        if x != 0:
            writer.box(batch, (x, 0, -14), (x + 8, 40, -12), color=(0.2, 0.2, 0.7, 1))
    for x in (-40.0, LONG + 40):
        writer.box(batch, (x, 0, -14), (x + 1, 40, 14), color=(0.2, 0.7, 0.2, 1))
    if house is not None:
        x, high = house
        writer.box(batch, (x + 2, 0, -40), (x + 6, high, -36), color=(0.9, 0.9, 0.1, 1))
    return writer.write(folder, block_triangles=24)


def add_scene(store, name, **how):
    target = store.local_path(layout.prepared_prefix(name))
    scene = street(target, **how)
    info = scene.info.model_copy(update={"id": name})
    (target / "scene.json").write_text(info.model_dump_json(), encoding="utf-8")
    return info


def bake(store, info, follows=None, cells=2, **settings):
    """Bake the first cells of a street as an executor does; returns the walk and the answers."""
    corridor = Corridor(box=Box(min=(0, 1, -2), max=(4.0 * cells, 5, 2)))
    wanted = BakeSettings(**SETTINGS | settings)
    walk = create_bake(store, info, corridor, wanted, follows=follows)
    names = [f"{i}_0_0" for i in range(cells)]
    answers = io.StringIO()
    serve(store, walk.id, io.StringIO("\n".join(names) + "\n"), answers)
    lines = [json.loads(line) for line in answers.getvalue().splitlines()][1:]
    assert all(line["ok"] for line in lines), lines
    assert len(walk_grid(store, walk).indices()) == cells == len(lines)
    return walk, [bool(line["figures"]["carried"]) for line in lines]


def seen_by_rays(scene, triangles, centre, half, eyes=60, rays=40):
    """The slow way: look from anywhere in a cell at anywhere on some triangles."""
    rng = np.random.default_rng(7)
    corners = np.asarray(scene.positions)[np.asarray(scene.triangles)[triangles]] + scene.origin
    corners_first = np.array(list(itertools.product((-half, half), repeat=3)))
    for eye in centre + np.concatenate([corners_first, rng.uniform(-half, half, (eyes, 3))]):
        which = rng.integers(len(triangles), size=rays)
        weights = rng.dirichlet((1, 1, 1), rays)[..., None]
        towards = (corners[which] * weights).sum(axis=1) - eye
        distance = cast(scene, eye, towards, np.zeros((rays, 2), np.int64)).distance
        nearest = distance.argmin(axis=1)
        if np.isin(nearest[np.isfinite(distance.min(axis=1))], triangles).any():
            return True
    return False


def cell(store, walk, i):
    return parse(CellFile, store.get(layout.cell_key(walk.id, (i, 0, 0))), "cell")


@pytest.fixture
def store(tmp_path):
    return Store.open(tmp_path / "store")


@pytest.mark.parametrize("quads", ["slanted", "layers"])
def test_only_cells_that_can_see_an_edit_are_baked_again(store, quads):
    first, carried = bake(store, add_scene(store, "before"), cells=CELLS, quads=quads)
    assert not any(carried)
    edited = add_scene(store, "after", house=(0.0, 9.0))
    second, carried = bake(store, edited, follows=first.id, cells=CELLS, quads=quads)
    assert not carried[0]  # right before the gap
    for i in np.flatnonzero(carried).tolist():
        keys = [layout.cell_key(walk.id, (i, 0, 0)) for walk in (first, second)]
        assert store.get(keys[0]) == store.get(keys[1])
    scenes = [open_prepared(store, name) for name in ("before", "after")]
    edit = changes(*scenes)
    assert len(edit.gone) == len(edit.come) == 10  # its floor stays, and so does its top's outline
    grid = walk_grid(store, second)
    visible = [
        any(
            seen_by_rays(scene, triangles, grid.centre((i, 0, 0)), 2.0)
            for scene, triangles in zip(scenes, edit, strict=True)
        )
        for i in range(CELLS)
    ]
    assert visible[0]
    assert not any(np.array(visible) & carried)
    # nor is much baked for nothing: two cells from which the house is all but seen
    assert carried.count(False) <= sum(visible) + 2
    assert carried.count(True) >= 2


@pytest.mark.parametrize(
    ("edit", "settings"),
    [
        ({"floor": (0.4, 0.3, 0.3, 1)}, {}),
        ({"house": None}, {"visibility": "off"}),
        ({}, {"tolerance": 0.5}),
    ],
    ids=str,
)
def test_all_are_baked_again_where_all_may_differ(store, edit, settings):
    first, _ = bake(store, add_scene(store, "before"), visibility=settings.get("visibility", "on"))
    _, carried = bake(store, add_scene(store, "after", **edit), follows=first.id, **settings)
    assert not any(carried)


def test_a_scene_prepared_again_needs_no_baking(store):
    first, _ = bake(store, add_scene(store, "before"))
    _, carried = bake(store, add_scene(store, "after"), follows=first.id)
    assert all(carried)


def test_what_is_gone_is_baked(store):
    """A cell, or a page that it names, or the bake that was followed."""
    first, _ = bake(store, add_scene(store, "before"), cells=5)
    store.delete(layout.cell_key(first.id, (1, 0, 0)))
    store.delete(layout.atlas_key(cell(store, first, 3).atlases[0]))
    walk, carried = bake(store, add_scene(store, "after"), follows=first.id, cells=5)
    assert carried == [i not in (1, 3) for i in range(5)]
    assert store.exists(layout.atlas_key(cell(store, walk, 3).atlases[0]))
    store.delete_prefix(layout.bake_prefix(walk.id))
    store.delete_prefix(layout.bake_prefix(first.id))
    with pytest.raises(NotFoundError):
        bake(store, add_scene(store, "other"), follows=first.id)


def test_cells_of_another_version_of_the_baker_are_baked(store, monkeypatch):
    monkeypatch.setattr("farfield_worker.cell.bake.VERSION", 0)
    first, _ = bake(store, add_scene(store, "before"))
    monkeypatch.undo()
    _, carried = bake(store, add_scene(store, "after"), follows=first.id)
    assert not any(carried)
