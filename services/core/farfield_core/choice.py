"""The settings that a bake is made with, where some of them are left to Farfield."""

from __future__ import annotations

from farfield_core.budget import within_budget
from farfield_core.corridor import Corridor
from farfield_core.near_border import is_open, with_cheapest_border
from farfield_core.plan import Choice, plan
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings


def choose(scene: SceneInfo, corridor: Corridor, settings: BakeSettings) -> Choice:
    """Settings without a budget and with a near border, and what they come to.

    Raises BadInputError where no cell keeps the budget, and as `plan` does.
    """
    if settings.budget is not None:
        return within_budget(scene, corridor, settings)
    if is_open(settings):
        return with_cheapest_border(scene, corridor, settings)
    return Choice(settings, plan(scene, corridor, settings))
