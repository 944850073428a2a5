"""The near border by cost, against trying many."""

import pytest
from farfield_core.bake import create_bake, settings_of
from farfield_core.choice import choose
from farfield_core.corridor import parse_corridor
from farfield_core.near_border import cost, is_open, with_cheapest_border
from farfield_core.plan import plan
from farfield_core.scene import Block, Part, SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.store import Store

from tests.unit.walks import scene_info

STREET = parse_corridor({"path": {"points": [[0, 0, 0], [90, 0, 0]], "width": 4, "height": 3}})


def field(triangles: int) -> SceneInfo:
    """Blocks of 10 m all over 400 m, as many `triangles` in each."""
    blocks = tuple(
        Block(
            low=(x, 0.0, z),
            high=(x + 10.0, 10.0, z + 10.0),
            first_vertex=0,
            vertices=3,
            parts=(Part(batch=0, first_triangle=0, triangles=triangles),),
        )
        for x in range(-200, 200, 10)
        for z in range(-200, 200, 10)
    )
    return scene_info().model_copy(
        update={"origin": (0.0, 0.0, 0.0), "blocks": blocks, "triangles": 1600 * triangles}
    )


@pytest.mark.parametrize("triangles", [1, 30, 300, 3000])
def test_no_border_between_the_extremes_is_much_cheaper(triangles: int) -> None:
    scene, settings = field(triangles), BakeSettings()
    chosen = with_cheapest_border(scene, STREET, settings)
    least = cost(chosen.plan.near_triangles, chosen.plan.quads)
    usual = settings.near_field
    for step in range(-40, 1):
        near = usual * 2 ** (step / 20)
        planned = plan(scene, STREET, settings.model_copy(update={"near": near}))
        # between two of the borders tried lies a factor of 1.19
        assert least <= cost(planned.near_triangles, planned.quads) * 1.06


def test_the_denser_the_scene_the_closer_the_border() -> None:
    near = [choose(field(n), STREET, BakeSettings()).plan.near_field for n in (1, 30, 300, 3000)]
    assert near == sorted(near, reverse=True)
    assert near[0] == BakeSettings().near_field > 3 * near[-1]


def test_what_is_given_is_kept() -> None:
    scene = field(3000)
    assert choose(scene, STREET, BakeSettings(near=30)).settings.near == 30
    for given in ({"layers": 64}, {"quads": "layers"}, {"quads": "layers", "layers": 32}):
        settings = BakeSettings.model_validate(given)
        assert not is_open(settings)
        assert choose(scene, STREET, settings).settings == settings


def test_a_bake_is_made_with_the_border_of_its_plan() -> None:
    store, scene = Store.open("memory://"), field(3000)
    walk = create_bake(store, scene, STREET, BakeSettings())
    planned = choose(scene, STREET, BakeSettings())
    assert walk.near_field == planned.plan.near_field
    assert settings_of(walk) == planned.settings
    assert create_bake(store, scene, STREET, settings_of(walk)).id == walk.id


def test_a_bake_that_follows_another_keeps_its_border() -> None:
    store = Store.open("memory://")
    before = create_bake(store, field(30), STREET, BakeSettings())
    edited = field(3000).model_copy(update={"id": "5ce0e0000000c0d1"})
    after = create_bake(store, edited, STREET, BakeSettings(), follows=before.id)
    assert after.near_field == before.near_field
    assert create_bake(store, edited, STREET, BakeSettings()).near_field < before.near_field


def test_the_border_stays_away_from_the_cell() -> None:
    settings = BakeSettings(cell_size=10, resolution=64, alpha=0.2)
    assert 6 < settings.near_field < 2 * 5.5
    assert 5.5 < choose(field(3000), STREET, settings).plan.near_field < 5.5 * 1.2
    # one that cannot come closer stays where it is
    settings = BakeSettings(cell_size=10, gap_texels=None, alpha=0.78)
    assert settings.near_field < 5.5
    assert choose(field(3000), STREET, settings).settings.near == settings.near_field
