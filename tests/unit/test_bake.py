"""Bakes: deterministic ids, create-only manifests, paged tables, what is done and missing."""

import json

import numpy as np
import pytest
from farfield_core import format as walk_format
from farfield_core.bake import (
    bake_id,
    create_bake,
    done_cells,
    missing_cells,
    read_walk,
    relocate,
    settings_of,
)
from farfield_core.cells import CellGrid
from farfield_core.corridor import Corridor, cut, parse_corridor
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.tables import PAGE_CELLS, cell_table_pages, walk_grid
from farfield_core.walk import Places
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.walks import row_of_cells, scene_info

SETTINGS = BakeSettings(resolution=64, layers=4)


def box(x: float, y: float, z: float) -> Corridor:
    return parse_corridor({"box": {"min": [0, 0, 0], "max": [x, y, z]}})


def test_the_same_bake_is_found_again() -> None:
    store = Store.open("memory://")
    walk = create_bake(store, scene_info(), box(30, 10, 10), SETTINGS)
    before = {key: store.get(key) for key in store.list("")}
    assert create_bake(store, scene_info("renamed"), box(30, 10, 10), SETTINGS) == walk
    assert {key: store.get(key) for key in store.list("")} == before
    assert read_walk(store, walk.id) == walk
    assert settings_of(walk) == SETTINGS


def test_the_id_depends_on_all_that_matters() -> None:
    ids = {
        bake_id("a", box(30, 10, 10), SETTINGS),
        bake_id("b", box(30, 10, 10), SETTINGS),
        bake_id("a", box(31, 10, 10), SETTINGS),
        bake_id("a", box(30, 10, 10).model_copy(update={"follow_ground": True}), SETTINGS),
        bake_id("a", box(30, 10, 10), SETTINGS.model_copy(update={"layers": 5})),
    }
    assert len(ids) == 5
    assert all(len(i) == 16 and set(i) <= set("0123456789abcdef") for i in ids)


def test_the_manifest_keeps_its_format() -> None:
    store = Store.open("memory://")
    walk = create_bake(store, scene_info(), box(30, 10, 20), SETTINGS)
    walk_format.validate("walk", walk_format.load(store.get(f"bakes/{walk.id}/walk.json")))
    assert list(walk_format.walk_faults(walk)) == []
    assert walk.near_field == SETTINGS.place().near_field
    assert walk.start.eye == (5.0, 5.0, 5.0)
    assert walk.start.yaw == pytest.approx(-np.pi / 2)  # along +x


@pytest.mark.parametrize(
    ("step", "yaw"),
    [((0, 0, -9), 0.0), ((-9, 0, 0), np.pi / 2), ((9, 0, 0), -np.pi / 2), ((9, 3, -9), -np.pi / 4)],
)
def test_a_walk_starts_along_its_path(step: tuple[float, float, float], yaw: float) -> None:
    corridor = parse_corridor(
        {
            "path": {
                "points": [[1, 2, 3], [1, 2, 3], np.add([1, 2, 3], step).tolist()],
                "width": 2,
                "height": 2,
            }
        }
    )
    walk = create_bake(Store.open("memory://"), scene_info(), corridor, SETTINGS)
    assert walk.start.eye == (1.0, 7.0, 3.0)
    assert walk.start.yaw == pytest.approx(yaw)


def test_large_corridors_are_paged() -> None:
    store = Store.open("memory://")
    walk = create_bake(store, scene_info(), box(1000, 10, 1000), SETTINGS)
    assert walk.grid.total == 10_000
    assert walk.grid.cells is None
    assert [page.cells for page in walk.grid.pages] == [4096, 4096, 1808]
    assert len(store.get(f"bakes/{walk.id}/walk.json")) < 5000
    for page in walk.grid.pages:
        document = walk_format.load(store.get(f"bakes/{walk.id}/{page.href}"))
        walk_format.validate("page", document)
        assert len(document["i"]) == page.cells
    grid = walk_grid(store, walk)
    whole = cut(box(1000, 10, 1000), (10, 10, 10))
    assert set(grid.indices()) == set(whole.indices())
    distance = np.linalg.norm(grid.centres() - np.array(walk.start.eye), axis=1)
    assert (np.diff(distance) >= 0).all()


def test_a_table_inline_keeps_the_baking_order() -> None:
    store = Store.open("memory://")
    walk = create_bake(store, scene_info(), box(70, 30, 50), SETTINGS)
    grid, whole = walk_grid(store, walk), cut(box(70, 30, 50), (10, 10, 10))
    np.testing.assert_array_equal(grid.index, whole.index)
    np.testing.assert_array_equal(grid.centres(), whole.centres())


@given(st.integers(0, 2**32 - 1), st.integers(PAGE_CELLS + 1, 3 * PAGE_CELLS))
def test_pages_hold_every_cell_once_and_lie_together(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    index = np.unique(random.integers(-60, 60, (count, 3)), axis=0).astype(np.int32)
    y = random.normal(size=len(index))
    grid = CellGrid(np.array([1.0, 2.0, 3.0]), np.array([2.0, 3.0, 4.0]), index, y)
    tables = cell_table_pages(grid)
    if len(index) <= PAGE_CELLS:
        assert not tables.pages
        return
    seen = {}
    for page in tables.grid.pages:
        table = tables.pages[page.href]
        assert len(table.i) == page.cells <= PAGE_CELLS
        for i, j, k, low in zip(table.i, table.j, table.k, table.y, strict=True):
            assert (i, j, k) not in seen
            seen[i, j, k] = low
            assert page.bounds.min[0] <= 1 + 2 * i <= page.bounds.max[0] - 2
            assert page.bounds.min[1] <= low <= page.bounds.max[1] - 2.999999
    assert seen == dict(zip(grid.indices(), y.tolist(), strict=True))


def test_done_and_missing() -> None:
    store = Store.open("memory://")
    walk = row_of_cells(store, 4)
    assert done_cells(store, walk.id) == set()
    assert missing_cells(store, walk) == [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]
    store.put_new(f"bakes/{walk.id}/cells/2_0_0.json", b"{}")
    store.put_new(f"bakes/{walk.id}/cells/0_0_0.json.part", b"{}")
    assert done_cells(store, walk.id) == {(2, 0, 0)}
    assert missing_cells(store, walk) == [(0, 0, 0), (1, 0, 0), (3, 0, 0)]


def test_what_is_not_there() -> None:
    with pytest.raises(NotFoundError):
        read_walk(Store.open("memory://"), "0123456789abcdef")


def test_a_damaged_manifest_is_explained() -> None:
    store = Store.open("memory://")
    walk = row_of_cells(store)
    document = json.loads(store.get(f"bakes/{walk.id}/walk.json"))
    document["version"] = 2
    store.put(f"bakes/{walk.id}/walk.json", json.dumps(document).encode())
    with pytest.raises(BadInputError, match="version"):
        read_walk(store, walk.id)


def test_relocate() -> None:
    walk = row_of_cells(Store.open("memory://"))
    moved = relocate(walk, Places(cells="c/", atlases="https://cdn.example/a/", near="n/"))
    assert moved.places.cells == "c/"
    assert moved.model_copy(update={"places": walk.places}) == walk
    with pytest.raises(BadInputError, match="slash"):
        relocate(walk, Places.model_construct(cells="c", atlases="a/", near="n/"))
