"""Pictures of what each measure against seams does: full render, without it, with it.

    python -m bench.seams

One cell of the demo city is baked with every measure, and again with each one left out. Of many
views from corners and random eyes the crop is kept where a measure mends most. The pictures lie in
docs/pictures, beside the page that shows them (docs/slanted-quads.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bench.stand import Stand, city, one_process

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
VIEWS = 60
#: pixels of a crop, and how much it is enlarged
CROP, SCALE = 72, 4
_QUADS = "farfield_worker.slanted.quads."

Rgb = NDArray[np.uint8]


@contextmanager
def without(measure: str) -> Iterator[None]:
    """Bake without one measure while this lasts."""
    from farfield_worker.slanted import fill, quads  # noqa: PLC0415 - after the environment is set

    nothing = np.inf

    def captured(sheets: Any, starts: Any, disparity: Any, low: Any, high: Any, n: int) -> Any:
        return fill.fill(sheets, starts, disparity, low + nothing, high, n)

    def endless(texels: Any, *rest: Any) -> Any:
        count = len(texels.rect)
        return np.zeros(count), np.full(count, nothing)

    def whole(polygon: Any, plane: Any, *rest: Any, cut: bool = False) -> Any:
        return [(polygon, plane)]

    replaced = {
        "fill": {_QUADS + "fill": captured},
        "hairlines": {"farfield_worker.slanted.clip.GROWTH": 0.0},
        "spikes": {_QUADS + "disparity_range": endless},
        "near_border": {_QUADS + "split": whole},
    }
    with ExitStack() as stack:
        for name, value in replaced.get(measure, {}).items():
            stack.enter_context(patch(name, value))
        assert quads is not None
        yield


def main() -> None:
    """Write all pictures."""
    one_process()
    from farfield_core.settings import BakeSettings  # noqa: PLC0415 - as above
    from farfield_worker.verify.metrics import unmatched  # noqa: PLC0415

    # the near border close by, where seams show most
    settings = BakeSettings(cell_size=(14, 14, 14), near=15)
    PICTURES.mkdir(exist_ok=True)
    with city(settings, triangles=200_000) as stand:
        full, complete = _draw(stand, "", scene=True), _draw(stand, "")
        for measure in ("fill", "hairlines", "spikes", "near_border", "residual"):
            lacking = _draw(stand, measure)
            best, where = -1.0, (0, 0, 0)
            for n, (true, before, after) in enumerate(zip(full, lacking, complete, strict=True)):
                mended = unmatched(true, before) | unmatched(before, true)
                mended = mended.astype(np.int64) - (unmatched(true, after) | unmatched(after, true))
                sums = np.pad(mended.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
                crops = sums[CROP:, CROP:] - sums[:-CROP, CROP:]
                crops = crops - sums[CROP:, :-CROP] + sums[:-CROP, :-CROP]
                if crops.max() > best:
                    y, x = np.unravel_index(int(crops.argmax()), crops.shape)
                    best, where = float(crops.max()), (n, int(y), int(x))
            n, y, x = where
            row = [p[n][y : y + CROP, x : x + CROP] for p in (full, lacking, complete)]
            gap = np.full((CROP, 1, 3), 255, np.uint8)
            sheet = np.concatenate([row[0], gap, row[1], gap, row[2]], axis=1)
            picture = Image.fromarray(sheet)
            size = (picture.width * SCALE, picture.height * SCALE)
            picture.resize(size, Image.Resampling.NEAREST).save(
                PICTURES / f"seams_{measure}.png", optimize=True
            )
            print(f"{measure:12} mends {best:.0f} of {CROP * CROP} pixels of its picture")


def _draw(stand: Stand, measure: str, scene: bool = False) -> list[Rgb]:
    """Pictures of the first cell without `measure`, or else of the scene itself."""
    from farfield_core.tables import walk_grid  # noqa: PLC0415 - as above
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415
    from farfield_worker.cell.slanted import SlantedImpostors  # noqa: PLC0415
    from farfield_worker.shoot.scene import SceneShooter  # noqa: PLC0415
    from farfield_worker.shoot.view import View  # noqa: PLC0415
    from farfield_worker.shoot.walk import WalkShooter  # noqa: PLC0415
    from farfield_worker.verify.views import poses  # noqa: PLC0415

    grid = walk_grid(stand.store, stand.walk)
    index = grid.indices()[1]
    centre = grid.centre(index)
    views = [
        View((float(p.eye[0]), float(p.eye[1]), float(p.eye[2])), p.yaw, p.pitch, 60.0, 512, 0.1)
        for p in poses(centre, np.array(stand.walk.grid.size) / 2, (0, 1, 4, 5), VIEWS, 11)
    ]
    if scene:
        scenes = SceneShooter(stand.scene)
        shown = [np.asarray(scenes.shoot(view).rgba[..., :3]) for view in views]
        scenes.close()
        return shown
    folder = stand.store.local_path(f"bakes/{stand.walk.id}")
    assert folder is not None
    (folder / "cells" / f"{index[0]}_{index[1]}_{index[2]}.json").unlink(missing_ok=True)
    with without(measure):
        baker = CellBaker(stand.scene, stand.walk, stand.store)
        if measure == "residual":
            assert isinstance(baker._maker, SlantedImpostors)
            baker._maker._settings = replace(baker._maker._settings, residual=False)
        baker.bake(index, centre)
        baker.close()
    walks = WalkShooter(folder)
    shown = [np.asarray(walks.shoot(view, index).rgba[..., :3]) for view in views]
    walks.close()
    return shown


if __name__ == "__main__":
    main()
