"""A cell from scene to files."""

import numpy as np
import pytest
from farfield_core import format as walk_format
from farfield_core import layout
from farfield_core.scenes import open_prepared
from farfield_core.tables import walk_grid
from farfield_core.validation import parse
from farfield_core.walk import CellFile
from farfield_worker.cell.bake import CellBaker
from farfield_worker.render import open_renderer

from tests.unit.cells import front_texels, pages_of, pebble, small_bake

pytestmark = pytest.mark.usefixtures("graphics")

INDEX = (0, 0, 0)


def bake(walk, store, index=INDEX):
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    try:
        return baker.bake(index, walk_grid(store, walk).centre(index))
    finally:
        baker.close()


def checked(walk, store, index=INDEX):
    """The cell as it lies in the store, its format and everything it names checked."""
    data = store.get(layout.cell_key(walk.id, index))
    walk_format.validate("cell", walk_format.load(data))
    cell = parse(CellFile, data, "cell")
    assert list(walk_format.cell_faults(cell, walk)) == []
    assert all(store.exists(layout.atlas_key(name)) for name in cell.atlases)
    assert all(store.exists(layout.near_key(block.blob)) for block in cell.near)
    for page in pages_of(store, cell):
        assert page.shape == (walk.atlas.height, walk.atlas.width, 4)
    return cell


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"grower": "greedy", "encoder": "webp"},
        {"layers": 1},
        {"resolution": 75, "cell_size": (2, 1, 3)},
        {"gap_texels": None, "layers": 8},
        {"faces": "sides", "resolution": 33},
    ],
    ids=str,
)
def test_from_its_centre_a_cell_shows_what_was_rendered(tmp_path, settings):
    # texels behind near polygons are stored too: what visibility leaves out has a test of its own
    walk, store = small_bake(tmp_path, visibility="off", **settings)
    written = bake(walk, store)
    cell = checked(walk, store)
    assert cell == written
    assert cell.figures["quads"] == len(cell.quads.faces) > 0
    assert 0 < cell.figures["fill"] <= 1
    assert cell.figures["near_triangles"] > 0
    sizes = [store.size(layout.atlas_key(name)) for name in cell.atlases]
    assert cell.figures["atlas_bytes"] == sum(sizes)
    pages = pages_of(store, cell)
    renderer = open_renderer("moderngl", open_prepared(store, "test"))
    seen = rendered = 0
    for face in range(6):
        color, layer = front_texels(cell, pages, face, walk.resolution)
        texels = renderer.face(np.array(cell.eyes[0]), face, walk.borders, walk.resolution)
        # sorted by layer: the last one of a texel is the nearest
        expected = {
            int(texel): (int(on), tuple(rgba.tolist()))
            for texel, on, rgba in zip(texels.texel, texels.layer, texels.color, strict=True)
        }
        if face not in (0, 1, 4, 5) and settings.get("faces") == "sides":
            assert (layer < 0).all()
            continue
        for texel, (on, rgba) in expected.items():
            at = divmod(texel, walk.resolution)
            # gap filling may continue a near-field surface in front of it, behind that surface
            if layer[at] == on:
                assert tuple(color[at].tolist()) == rgba
                seen += 1
            else:
                assert layer[at] > on
        rendered += len(expected)
    renderer.close()
    assert seen > 0.9 * rendered > 0


def test_baking_again_changes_nothing(tmp_path):
    walk, store = small_bake(tmp_path)
    first = bake(walk, store)
    keys = sorted(store.list(""))
    before = {key: store.get(key) for key in keys}
    again = bake(walk, store)
    assert again.quads == first.quads
    assert again.atlases == first.atlases
    assert sorted(store.list("")) == keys
    assert {key: store.get(key) for key in keys} == before


def test_cells_of_one_baker_share_near_blocks(tmp_path):
    walk, store = small_bake(tmp_path)
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    grid = walk_grid(store, walk)
    names = []
    for index in grid.indices():
        baker.bake(index, grid.centre(index))
        names.append({block.blob for block in checked(walk, store, index).near})
    baker.close()
    assert len(names) == 2
    assert names[0] & names[1]


def test_a_scene_inside_the_near_field_has_no_quads(tmp_path):
    walk, store = small_bake(tmp_path, pebble, visibility="off")
    bake(walk, store)
    cell = checked(walk, store)
    assert cell.quads.faces == ()
    assert cell.atlases == ()
    assert cell.figures["atlas_bytes"] == cell.figures["texels"] == cell.figures["quads"] == 0
    assert cell.figures["near_triangles"] == 12


def test_the_cell_is_written_last(tmp_path):
    """Whoever finds a cell finds all it names, even if the bake stops in between."""
    walk, store = small_bake(tmp_path)

    class Recorder:
        def __init__(self):
            self.keys = []

        def put_new(self, key, data):
            self.keys.append(key)
            return store.put_new(key, data)

    recorder = Recorder()
    baker = CellBaker(open_prepared(store, "test"), walk, recorder)
    baker.bake(INDEX, walk_grid(store, walk).centre(INDEX))
    baker.close()
    assert recorder.keys[-1] == layout.cell_key(walk.id, INDEX)
    assert layout.cell_key(walk.id, INDEX) not in recorder.keys[:-1]
    assert len(recorder.keys) > 2
