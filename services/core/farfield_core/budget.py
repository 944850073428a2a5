"""Cell size and near border from a budget for each cell (LEMI 6 leaves this to future work).

A smaller cell has a smaller near field at the same bound, so fewer near triangles; a near border
drawn closer has fewer still, but takes more quads. So sizes are tried from large to small, at each
the near borders around the one that the settings' `layers` give, and the first that keeps the
budget is taken: the fewest cells that do. What a cell comes to is estimated as in a plan, without
counting on what visibility leaves out, for the cell that has most.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from farfield_core.corridor import Corridor, Point
from farfield_core.errors import BadInputError
from farfield_core.plan import Choice, Plan, plan
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings, Budget

#: steps of sqrt(2) from the largest cell to the smallest
SIZES = 16
#: steps of sqrt(2) that the near border may come closer, and go away
CLOSER, FARTHER = 6, 4
#: triangles are estimated from the bounds of blocks; a town's street had 1.18 times the estimate
SAFETY = 1.25
#: cells whose near triangles are counted
SAMPLED = 4096


def within_budget(scene: SceneInfo, corridor: Corridor, settings: BakeSettings) -> Choice:
    """The settings with cell size and near border chosen.

    `cell_size` is the largest one tried if it was given, `near` is kept if it was given.
    Raises BadInputError where no size keeps the budget.
    """
    budget = settings.budget
    assert budget is not None
    kilobytes = 1000 * (budget.megabytes or math.inf)
    last: Choice | None = None
    for size in _sizes(corridor, settings):
        try:
            choices = [
                Choice(tried, plan(scene, corridor, tried, SAMPLED))
                for tried in _borders(settings, size)
            ]
        except BadInputError:
            # more cells, or more layers, than there may be: smaller ones have even more
            break
        for choice in choices:
            if _keeps(choice.plan, budget):
                why = _why(choice, last)
                return Choice(choice.settings, choice.plan.model_copy(update={"why": why}))
        if choices:
            last = min(choices, key=lambda choice: _excess(choice.plan, budget))
            if min(choice.plan.before["kilobytes"] for choice in choices) > kilobytes:
                break  # of which smaller cells have as many
    raise BadInputError(_refusal(budget, last))


def _sizes(corridor: Corridor, settings: BakeSettings) -> Iterator[tuple[float, float, float]]:
    """Cell sizes from large to small: the given one, or a cube as wide as the corridor, first."""
    x, y, z = settings.cell_size
    if "cell_size" not in settings.model_fields_set:
        x = y = z = _extent(corridor)
    for step in range(SIZES):
        shrink = 2 ** (-step / 2)
        yield x * shrink, y * shrink, z * shrink


def _extent(corridor: Corridor) -> float:
    if corridor.box is not None:
        points: Sequence[Point] = (corridor.box.min, corridor.box.max)
        margin = 0.0
    else:
        assert corridor.path is not None
        points, margin = corridor.path.points, corridor.path.width or 0.0
    spans = (max(p[axis] for p in points) - min(p[axis] for p in points) for axis in (0, 2))
    return max(spans) + margin


def _borders(settings: BakeSettings, size: tuple[float, float, float]) -> Iterator[BakeSettings]:
    """The settings at one cell size, near borders from the usual one outwards both ways."""
    least = 0.55 * max(size)
    if settings.near is not None:
        if settings.near > least:
            yield settings.model_copy(update={"cell_size": size, "budget": None})
        return
    usual = settings.model_copy(update={"cell_size": size}).near_field
    for step in sorted(range(-CLOSER, FARTHER + 1), key=lambda step: (abs(step), step)):
        near = usual * 2 ** (step / 2)
        if near > least:
            # a hair more, so that as many layers as gave the usual border give it again
            chosen = {"cell_size": size, "near": near * (1 + 1e-9), "budget": None}
            yield settings.model_copy(update=chosen)


def _keeps(planned: Plan, budget: Budget) -> bool:
    return _excess(planned, budget) <= 1.0


def _excess(planned: Plan, budget: Budget) -> float:
    """How many times the budget a cell takes, the worse of both figures."""
    triangles = SAFETY * planned.before["most_near_triangles"] / (budget.triangles or math.inf)
    kilobytes = planned.before["kilobytes"] / (1000 * (budget.megabytes or math.inf))
    return max(triangles, kilobytes)


def _why(choice: Choice, before: Choice | None) -> str:
    text = f"{_named(choice)} have {_comes_to(choice.plan)} at most"
    if before is not None:
        text += f"; {_named(before)} would have {_comes_to(before.plan)}"
    return text[0].upper() + text[1:] + "."


def _refusal(budget: Budget, last: Choice | None) -> str:
    asked = " and ".join(
        text
        for text, value in (
            (f"{budget.triangles:,} near triangles" if budget.triangles else "", budget.triangles),
            (f"{budget.megabytes:g} MB" if budget.megabytes else "", budget.megabytes),
        )
        if value
    )
    if last is None:
        return f"No cell size keeps a budget of {asked} with this near border; leave near out."
    return (
        f"No cell size keeps a budget of {asked}: even {_named(last)} have "
        f"{_comes_to(last.plan)}; allow more, or lower the resolution."
    )


def _named(choice: Choice) -> str:
    edges = sorted(set(choice.settings.cell_size))
    size = " to ".join(f"{edge:.3g}" for edge in (edges[0], edges[-1])[: len(edges)])
    return f"cells of {size} m with a near field of {choice.plan.near_field:.3g} m"


def _comes_to(planned: Plan) -> str:
    triangles = f"{planned.before['most_near_triangles']:,.0f} near triangles"
    return f"{triangles} and {planned.before['kilobytes'] / 1000:.2g} MB"
