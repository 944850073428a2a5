"""Slanted quads of real scenes keep what is promised of them."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.scene import open_scene
from farfield_core.settings import BakeSettings
from farfield_worker.prepare import prepare
from farfield_worker.slanted.baker import SlantedBaker, SlantedSettings

from tests.corridors.scenes import DATA, SCENES, Scene
from tests.unit.slanted.promises import check_angles, check_order, check_tolerances

RESOLUTION = 128

pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"there are no real scenes in {DATA}"),
]


@pytest.mark.parametrize("scene", [s for s in SCENES.values() if s.source], ids=lambda s: s.name)
def test_promises(scene: Scene, tmp_path: Path) -> None:
    prepare(scene.model, tmp_path / "prepared", "scene", scene.name)
    prepared = open_scene(tmp_path / "prepared")
    bake = BakeSettings(resolution=RESOLUTION, layers=64, cell_size=scene.cell_size)
    baker = SlantedBaker(prepared, RESOLUTION)
    quads = 0
    for near in (bake.near_field, bake.near_field / 4):
        settings = SlantedSettings(
            bake.half_extents, max(near, 0.6 * scene.cell_size), bake.parallax, RESOLUTION
        )
        cell = baker.cell(scene.first, settings)
        quads += sum(len(part.quads.sheet) for part in cell.parts)
        check_tolerances(cell, settings)
        check_order(cell, settings)
        check_angles(cell, settings, every=50)
        shown = sum(len(part.quads.texels.texel) for part in cell.parts)
        filled = sum(int(np.sum(part.quads.texels.filled)) for part in cell.parts)
        assert filled <= 0.6 * shown
    baker.close()
    assert quads > 0
