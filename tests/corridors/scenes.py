"""The scenes that tests and benches bake, with the corridor and cell size that suit each.

Real scenes lie in the folder FARFIELD_TEST_DATA, by default ../shared/data beside the repository,
and are never copied into it. The demo city is written by Farfield itself.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from farfield_worker.demo import AVENUE

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DATA = Path(os.environ.get("FARFIELD_TEST_DATA", ROOT.parent / "shared" / "data"))


@dataclass(frozen=True)
class Scene:
    """One scene and how to bake it.

    Attributes:
        name: its corridor is `<name>.json` in this folder, that of the demo city its own.
        source: model file, relative to DATA; None for the demo city.
        cell_size: edge length of cells, in the scene's own units.
        first: the first cell's centre, to the scene's unit.
        faces: which faces show something: rooms have floors and ceilings.
    """

    name: str
    source: str | None
    cell_size: float
    first: tuple[float, float, float]
    faces: str = "sides"

    @property
    def corridor(self) -> Path:
        """Its corridor file."""
        if self.source is None:
            return AVENUE
        return HERE / f"{self.name}.json"

    @property
    def model(self) -> Path:
        """Its model file; the demo city has none."""
        assert self.source is not None
        return DATA / self.source


SCENES = {
    scene.name: scene
    for scene in (
        # on the road from the market to the eastern gate
        Scene("medieval_town_2M", "medieval_town/medieval_town_2M.glb", 10, (23, 2, -7)),
        # between the houses north-west of the market
        Scene("medieval_town_3M", "medieval_town/medieval_town_3M.glb", 10, (-92, 2, -112)),
        # a street in the middle of the town
        Scene("dover", "dover/dover.glb", 10, (860, 5, -1167)),
        # a clearing on a slope
        Scene("forest_alpha", "forest_alpha/forest_alpha.glb", 6, (-45, 0, 53)),
        # millimetres: across the carpet, towards the bed
        Scene("hotel_room", "hotel_room/hotel_room.glb", 250, (8985, 1540, -6387), "all"),
        # an eighth of a metre: along the arena's upper floor
        Scene("pandora", "pandora_indoor/pandora.obj", 16, (276, 270, -7), "all"),
        # down the avenue to the great temple
        Scene("city", None, 14, (0, 8, 308)),
    )
}
