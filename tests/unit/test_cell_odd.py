"""Cells in odd places, and settings at their limits, with either kind of quads."""

import pytest
from farfield_core import format as walk_format
from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import Box, Corridor
from farfield_core.scenes import open_prepared
from farfield_core.settings import BakeSettings
from farfield_core.tables import walk_grid
from farfield_core.validation import parse
from farfield_core.walk import CellFile
from farfield_worker.cell.bake import CellBaker

from tests.unit.cells import SETTINGS, pebble, small_bake, town

pytestmark = [
    pytest.mark.usefixtures("graphics"),
    pytest.mark.parametrize("quads", ["layers", "slanted"]),
]


def baked(walk, store):
    """The first cell of a walk, as it lies in the store and keeps its format."""
    grid = walk_grid(store, walk)
    index = grid.indices()[0]
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    baker.bake(index, grid.centre(index))
    baker.close()
    data = store.get(layout.cell_key(walk.id, index))
    walk_format.validate("cell", walk_format.load(data))
    cell = parse(CellFile, data, "cell")
    assert list(walk_format.cell_faults(cell, walk)) == []
    assert all(store.exists(layout.atlas_key(name)) for name in cell.atlases)
    return cell


def assert_no_far_field(cell):
    assert cell.quads.faces == ()
    assert cell.atlases == ()
    assert cell.figures["quads"] == cell.figures["atlas_bytes"] == 0


def walled_in(writer):
    """A town around a solid block that holds the first cell."""
    town(writer)
    writer.box(writer.batch(double_sided=True), (-1.6, -1.6, -1.6), (1.6, 1.6, 1.6))


@pytest.mark.parametrize(
    "settings", [{"layers": 1}, {"resolution": 75}, {"resolution": 33, "layers": 3}], ids=str
)
def test_settings_at_their_limits(tmp_path, quads, settings):
    cell = baked(*small_bake(tmp_path, quads=quads, **settings))
    assert cell.figures["quads"] == len(cell.quads.faces) > 0
    assert cell.figures["texels"] > 0


def test_a_scene_smaller_than_the_near_field_has_no_far_field(tmp_path, quads):
    cell = baked(*small_bake(tmp_path, pebble, quads=quads))
    assert_no_far_field(cell)
    # all of the box but its far side, which no eye in the cell can see
    assert cell.figures["near_triangles"] == 10


def test_a_cell_inside_a_solid_sees_nothing_but_its_walls(tmp_path, quads):
    cell = baked(*small_bake(tmp_path, walled_in, quads=quads))
    assert_no_far_field(cell)
    assert cell.figures["near_triangles"] == 12


def test_a_corridor_far_outside_its_scene_shows_it_whole(tmp_path, quads):
    _, store = small_bake(tmp_path)
    settings = BakeSettings(**SETTINGS | {"quads": quads})
    corridor = Corridor(box=Box(min=(899, -1, -1), max=(901, 1, 1)))
    walk = create_bake(store, open_prepared(store, "test").info, corridor, settings)
    cell = baked(walk, store)
    assert cell.near == ()
    # everything lies towards -x, at 600 m and more
    assert set(cell.quads.faces) == {1}


def test_a_corridor_at_the_end_of_the_world_is_empty(tmp_path, quads):
    _, store = small_bake(tmp_path)
    settings = BakeSettings(**SETTINGS | {"quads": quads})
    corridor = Corridor(box=Box(min=(1e6, -1, -1), max=(1e6 + 2, 1, 1)))
    walk = create_bake(store, open_prepared(store, "test").info, corridor, settings)
    cell = baked(walk, store)
    assert_no_far_field(cell)
    assert cell.near == ()
