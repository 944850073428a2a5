"""Plans agree with bakes, and are fast."""

import time

import numpy as np
import pytest
from farfield_core.bake import create_bake
from farfield_core.corridor import parse_corridor
from farfield_core.errors import BadInputError
from farfield_core.plan import Plan, near_triangles, plan
from farfield_core.settings import BakeSettings
from farfield_core.store import Store

from tests.unit.soup import soup
from tests.unit.walks import scene_info

CORRIDORS = {
    "box": {"box": {"min": [0, 0, 0], "max": [95, 25, 41]}},
    "ground box": {"box": {"min": [0, 0, 0], "max": [95, 25, 41]}, "follow_ground": True},
    "path": {"path": {"points": [[0, 0, 0], [70, 0, 30]], "width": 4, "height": 3}},
}


@pytest.mark.parametrize("name", ["box", "path"])
@pytest.mark.parametrize(
    "settings",
    [
        BakeSettings(resolution=64, layers=7, quads="layers"),
        BakeSettings(resolution=64, layers=7),
        BakeSettings(resolution=64, near=20),
    ],
)
def test_a_plan_says_what_the_bake_has(name: str, settings: BakeSettings) -> None:
    corridor = parse_corridor(CORRIDORS[name])
    planned = plan(scene_info(), corridor, settings)
    walk = create_bake(Store.open("memory://"), scene_info(), corridor, settings)
    assert planned.cells == walk.grid.total
    assert planned.near_field == walk.near_field
    assert planned.layers == len(walk.layers)


def test_following_the_ground_takes_one_cell_a_column() -> None:
    planned = plan(scene_info(), parse_corridor(CORRIDORS["ground box"]), BakeSettings())
    assert planned.cells == 10 * 5


def test_near_chooses_the_layers() -> None:
    corridor = parse_corridor(CORRIDORS["box"])
    planned = plan(scene_info(), corridor, BakeSettings(quads="layers", near=30))
    assert planned.near_field <= 30
    fewer = BakeSettings(quads="layers", layers=planned.layers - 1)
    assert plan(scene_info(), corridor, fewer).near_field > 30


@pytest.mark.parametrize("quads", ["slanted", "layers"])
def test_estimates_grow_with_what_they_depend_on(quads: str) -> None:
    corridor = parse_corridor(CORRIDORS["box"])

    def estimate(**settings: object) -> Plan:
        return plan(
            scene_info(), corridor, BakeSettings.model_validate({"quads": quads, **settings})
        )

    small = estimate(resolution=256, layers=16)
    for large in (estimate(resolution=512, layers=16), estimate(resolution=256, layers=64)):
        assert large.seconds > small.seconds > 0
        assert large.megabytes > small.megabytes > 0
        assert large.quads > small.quads > 0


def test_plans_follow_a_drag() -> None:
    huge = parse_corridor({"box": {"min": [0, 0, 0], "max": [10_000, 10, 10_000]}})
    long = parse_corridor(
        {"path": {"points": [[0, 0, 0], [5000, 0, 900]], "width": 20, "height": 3}}
    )
    for corridor in (huge, long):
        plan(scene_info(), corridor, BakeSettings())
        times = []
        for _ in range(5):
            began = time.perf_counter()
            plan(scene_info(), corridor, BakeSettings())
            times.append(time.perf_counter() - began)
        assert min(times) < 0.05


def test_what_cannot_be_baked_cannot_be_planned() -> None:
    corridor = parse_corridor({"box": {"min": [0, 0, 0], "max": [1e6, 1e6, 1e6]}})
    with pytest.raises(BadInputError):
        plan(scene_info(), corridor, BakeSettings())


def test_near_triangles_are_estimated_from_blocks() -> None:
    random = np.random.default_rng(6)
    middles = random.uniform(-100, 100, (20_000, 1, 3)) * (1, 0.05, 1)
    corners = middles + random.normal(0, 0.2, (20_000, 3, 3))
    # blocks are compact, as preparation makes them
    order = np.lexsort(((middles[:, 0, 2] // 10), (middles[:, 0, 0] // 10)))
    scene = soup(corners[order], origin=(30.0, 0.0, -40.0), blocks=400)
    centres = random.uniform(-60, 60, (20, 3)) * (1, 0.02, 1)
    guessed = near_triangles(scene.info, centres, 25.0)
    inside = np.abs(corners[None] - centres[:, None, None]).max(axis=-1).min(axis=-1) <= 25.0
    np.testing.assert_allclose(guessed, inside.sum(axis=1), rtol=0.15)


def test_a_plan_tells_what_visibility_leaves() -> None:
    random = np.random.default_rng(1)
    scene = soup(random.uniform(-50, 50, (3000, 1, 3)) + random.normal(0, 1, (3000, 3, 3))).info
    corridor = parse_corridor(CORRIDORS["path"])
    off = plan(scene, corridor, BakeSettings(visibility="off"))
    on = plan(scene, corridor, BakeSettings())
    assert on.before == off.before
    for name, value in off.before.items():
        assert getattr(off, name) == value > 0
        assert getattr(on, name) < value
    assert on.most_near_triangles >= on.near_triangles
    assert on.megabytes < off.megabytes
