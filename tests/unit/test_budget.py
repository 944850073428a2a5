"""Cell size and near border from a budget, against trying everything."""

from functools import lru_cache

import numpy as np
import pytest
from farfield_core.bake import create_bake, settings_of
from farfield_core.budget import SAFETY, within_budget
from farfield_core.corridor import Corridor, cut, parse_corridor
from farfield_core.errors import BadInputError
from farfield_core.plan import near_triangles, plan
from farfield_core.scene import Block, Part, SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.walk import OVERLAP

from tests.unit.walks import scene_info

STREET = parse_corridor({"path": {"points": [[0, 0, 0], [90, 0, 0]], "width": 4, "height": 3}})
BOX = parse_corridor({"box": {"min": [0, 0, 0], "max": [64, 8, 32]}})


@lru_cache
def town(seed: int = 0) -> SceneInfo:
    """Blocks of 2 to 10 m all over 400 m, crowded around one place beside the street."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-200, 200, (150, 3)) * (1, 0.05, 1)
    centres[:50] = np.array([60, 2, 8]) + rng.normal(0, 6, (50, 3))
    half = rng.uniform(1, 5, (150, 1))
    blocks = [
        Block(
            low=tuple(c - h),
            high=tuple(c + h),
            first_vertex=0,
            vertices=3,
            parts=(Part(batch=0, first_triangle=0, triangles=int(n)),),
        )
        for c, h, n in zip(centres, half, rng.integers(50, 4096, 150), strict=True)
    ]
    return scene_info().model_copy(update={"origin": (0.0, 0.0, 0.0), "blocks": blocks})


def settings(**given: object) -> BakeSettings:
    return BakeSettings.model_validate(given)


def most(scene: SceneInfo, corridor: Corridor, chosen: BakeSettings) -> float:
    """Near triangles of the fullest of all cells."""
    centres = cut(corridor, chosen.cell_size).centres()
    return float(near_triangles(scene, centres, chosen.near_field * OVERLAP).max())


@pytest.mark.parametrize("corridor", [STREET, BOX], ids=["path", "box"])
@pytest.mark.parametrize(
    ("quads", "triangles", "megabytes", "size"),
    [
        ("slanted", 30_000, 2.2, None),
        ("slanted", 12_000, 8.0, 14.0),
        ("slanted", 60_000, 8.0, None),
        ("layers", 40_000, 8.0, 20.0),
    ],
)
def test_no_cell_exceeds_the_budget(
    corridor: Corridor, quads: str, triangles: int, megabytes: float, size: float | None
) -> None:
    scene = town()
    given_size = {} if size is None else {"cell_size": size}
    asked = settings(
        quads=quads, budget={"triangles": triangles, "megabytes": megabytes}, **given_size
    )
    choice = within_budget(scene, corridor, asked)
    assert choice.settings.budget is None
    assert most(scene, corridor, choice.settings) <= triangles / SAFETY
    assert choice.plan.before["kilobytes"] <= 1000 * megabytes
    assert choice.plan.cells == len(cut(corridor, choice.settings.cell_size))
    assert max(choice.settings.cell_size) <= (size or 1e9)
    # the next larger size does not keep it, whichever near border is taken
    edge = max(choice.settings.cell_size) * 2**0.5
    if edge > (size or (94.0 if corridor is STREET else 64.0)) * (1 + 1e-9):
        return
    larger = asked.model_copy(update={"budget": None, "cell_size": (edge, edge, edge)})
    for step in range(-6, 5):
        near = larger.near_field * 2 ** (step / 2) * (1 + 1e-9)
        if near > 0.55 * edge:
            tried = larger.model_copy(update={"near": near})
            planned = plan(scene, corridor, tried)
            assert (
                most(scene, corridor, tried) > triangles / SAFETY
                or planned.before["kilobytes"] > 1000 * megabytes
            )


def test_a_tighter_budget_means_smaller_near_fields_and_more_cells() -> None:
    chosen = [
        within_budget(town(), STREET, settings(budget={"triangles": n})).plan
        for n in (400_000, 100_000, 25_000)
    ]
    assert [p.cells for p in chosen] == sorted(p.cells for p in chosen)
    fields = [p.near_field for p in chosen]
    assert fields == sorted(fields, reverse=True)
    assert fields[0] > 2 * fields[-1]


def test_the_plan_says_why() -> None:
    why = within_budget(town(), STREET, settings(budget={"triangles": 25_000})).plan.why
    assert why.startswith("Cells of ")
    assert "near triangles" in why
    assert "would have" in why


def test_a_given_near_border_is_kept() -> None:
    asked = settings(near=12, cell_size=20, budget={"triangles": 200_000})
    assert within_budget(town(), STREET, asked).settings.near == 12
    with pytest.raises(BadInputError, match="leave near out"):
        within_budget(
            town(),
            STREET,
            settings(near=1e-2, cell_size=1e-3, budget={"triangles": 1}).model_copy(
                update={"cell_size": (90.0,) * 3}
            ),
        )


def test_a_budget_leads_to_the_bake_that_its_choice_names() -> None:
    store, asked = Store.open("memory://"), settings(budget={"triangles": 50_000})
    walk = create_bake(store, town(), STREET, asked)
    chosen = within_budget(town(), STREET, asked).settings
    assert settings_of(walk) == chosen
    assert walk.near_field == chosen.near_field
    assert walk.grid.size == chosen.cell_size
    assert create_bake(store, town(), STREET, chosen).id == walk.id


def test_what_no_size_keeps_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"^No cell size keeps a budget of 0\.001 MB: even "):
        within_budget(town(), STREET, settings(budget={"megabytes": 0.001}))
    for wrong in ({}, {"triangles": 0}, {"megabytes": -1}, {"cells": 3}):
        with pytest.raises(ValueError, match="budget"):
            settings(budget=wrong)


def test_an_empty_scene_is_one_cell() -> None:
    empty = town().model_copy(update={"blocks": []})
    choice = within_budget(empty, BOX, settings(budget={"triangles": 1}))
    assert choice.plan.cells == 1
