"""The near border where near triangles and quads together cost least to draw (LEMI 3.1 fixes it).

Drawn closer, the border leaves fewer near triangles, and more quads to stand for what was near. The
paper's border lies where its layers end; planes of any slant bear one several times closer for a
few more quads, so it is a choice: the cheapest of some borders up to the paper's, as a plan
estimates them for the mean cell of the corridor. Farther away than that a small scene would have
no far field left, and no cell fewer near triangles.
"""

from __future__ import annotations

from farfield_core.corridor import Corridor
from farfield_core.plan import Choice, plan
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings

#: near triangles that cost as much as a quad: its polygon's own, and the pixels that its picture
#: covers in vain
QUAD = 4.0
#: steps of the fourth root of 2 that the border may come closer
CLOSER = 8
#: half extents of the cell that it stays away at least
LEAST = 1.1


def is_open(settings: BakeSettings) -> bool:
    """Whether the settings leave the near border to us."""
    return settings.quads == "slanted" and not {"near", "layers"} & settings.model_fields_set


def with_cheapest_border(scene: SceneInfo, corridor: Corridor, settings: BakeSettings) -> Choice:
    """The settings with `near` chosen, and their plan; raises BadInputError as `plan` does."""
    usual = settings.near_field
    least = LEAST * max(settings.half_extents)
    closer = (usual * 2 ** (step / 4) for step in range(-CLOSER, 0))
    choices = [
        _planned(scene, corridor, settings.model_copy(update={"near": near}))
        for near in (*(near for near in closer if near > least), usual)
    ]
    return min(choices, key=lambda choice: cost(choice.plan.near_triangles, choice.plan.quads))


def cost(near_triangles: float, quads: float) -> float:
    """What a cell costs to draw, in near triangles."""
    return near_triangles + QUAD * quads


def _planned(scene: SceneInfo, corridor: Corridor, settings: BakeSettings) -> Choice:
    return Choice(settings, plan(scene, corridor, settings))
