"""The paper's tables (LEMI section 6): its figure, ours and the ratio, for one cell.

    python -m bench.paper [--json] [--keep]

The demo city, 14 m cells, faces of 512 texels, 64 layers, one process on one core; means over the
corridor's first cells, the first of which is baked once more before to warm up.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image

from bench.stand import city, one_process, report

CELLS = 4
#: what the paper prints for the same settings, on its machine of 2002
PAPER = {
    "near_field_width_m": 118.0,
    "seconds_per_cell": 150.0,
    "kilobytes_packed": 6018.0,
    "kilobytes_png": 288.0,
}


def figures() -> dict[str, Any]:
    """Paper's figure, ours and ours : paper's, by name."""
    one_process()
    from farfield_core.settings import BakeSettings  # noqa: PLC0415 - after the environment is set
    from farfield_core.tables import walk_grid  # noqa: PLC0415
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415

    settings = BakeSettings(quads="layers", cell_size=(14, 14, 14), layers=64, resolution=512)
    with city(settings) as stand:
        grid = walk_grid(stand.store, stand.walk)
        indices = grid.indices()[:CELLS]
        baker = CellBaker(stand.scene, stand.walk, stand.store)
        baker.bake(indices[0], grid.centre(indices[0]))
        cells = [baker.bake(index, grid.centre(index)) for index in indices]
        baker.close()
        packed = []
        for cell in cells:
            pages = [stand.store.get(f"blobs/atlases/{name}") for name in cell.atlases]
            used = sum(rows_used(page) for page in pages)
            packed.append(used * stand.walk.atlas.width * 4 / 1024)
        faces = [len(set(cell.quads.faces)) for cell in cells]
    mean = {
        name: float(np.mean([cell.figures[name] for cell in cells])) for name in cells[0].figures
    }
    ours = {
        "near_field_width_m": 2 * stand.walk.near_field,
        "seconds_per_cell": mean["seconds"],
        "kilobytes_packed": float(np.mean(packed)),
        "kilobytes_png": mean["atlas_bytes"] / 1024,
    }
    table = {
        name: {"paper": PAPER[name], "ours": ours[name], "ratio": ours[name] / PAPER[name]}
        for name in PAPER
    }
    return {**table, "faces": float(np.mean(faces)), "cell": mean}


def rows_used(page: bytes) -> int:
    """Rows of an atlas page down to the last one with a texel."""
    alpha = np.asarray(Image.open(io.BytesIO(page)).getchannel("A"))
    rows = np.flatnonzero(alpha.any(axis=1))
    return int(rows[-1]) + 1 if len(rows) else 0


if __name__ == "__main__":
    report("paper", figures())
