"""A small town in a store, ready to be baked, and what a baked cell's files show."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core import layout
from farfield_core.bake import create_bake
from farfield_core.corridor import Box, Corridor
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.walk import CellFile, Walk
from numpy.typing import NDArray
from PIL import Image

from tests.unit.scenes import SceneWriter

SETTINGS: dict[str, Any] = {
    "quads": "layers",
    "cell_size": 2,
    "layers": 12,
    "resolution": 40,
    "faces": "all",
}


def town(writer: SceneWriter) -> None:
    """Houses on a floor around the origin, from near to far."""
    rng = np.random.default_rng(5)
    batch = writer.batch()
    floor = np.array([[-300, -2, 300], [300, -2, 300], [300, -2, -300], [-300, -2, -300]])
    writer.quad(batch, floor, color=(0.2, 0.4, 0.1, 1))
    for distance in np.exp(rng.uniform(np.log(6), np.log(200), 60)):
        angle = rng.uniform(0, 2 * np.pi)
        x, z = distance * np.cos(angle), distance * np.sin(angle)
        size = rng.uniform(0.1, 0.3, 3) * distance
        color = (*rng.uniform(0.1, 1, 3), 1)
        writer.box(batch, (x, -2, z), (x + size[0], -2 + 2 * size[1], z + size[2]), color=color)


def pebble(writer: SceneWriter) -> None:
    """One small box, nearer than any border."""
    writer.box(writer.batch(), (1.5, -0.5, -0.5), (2.0, 0.5, 0.5))


def small_bake(folder: Path, fill: Any = town, **settings: Any) -> tuple[Walk, Store]:
    """Write a scene and the manifest of a bake of two cells."""
    store = Store.open(folder / "store")
    target = store.local_path(layout.prepared_prefix("test"))
    assert target is not None
    writer = SceneWriter()
    fill(writer)
    scene = writer.write(target)
    corridor = Corridor(box=Box(min=(-1, -1, -1), max=(2.5, 1, 1)))
    return create_bake(store, scene.info, corridor, BakeSettings(**SETTINGS | settings)), store


def pages_of(store: Store, cell: CellFile) -> list[NDArray[np.uint8]]:
    """The cell's atlas pages, as any picture library reads them."""
    out = []
    for name in cell.atlases:
        with Image.open(io.BytesIO(store.get(layout.atlas_key(name)))) as image:
            out.append(np.asarray(image.convert("RGBA")))
    return out


def front_texels(cell: CellFile, pages: list[NDArray[np.uint8]], face: int, resolution: int) -> Any:
    """What the quads of a face show from the cell's centre: colours (R, R, 4), layers (R, R)."""
    color = np.zeros((resolution, resolution, 4), np.uint8)
    layer = np.full((resolution, resolution), -1)
    quads = cell.quads
    for q, number in enumerate(quads.faces):
        if number != face:
            continue
        corners = np.array(quads.corners[8 * q : 8 * q + 8]).reshape(4, 2)
        (x0, y0), (x1, y1) = corners.min(axis=0).astype(int), corners.max(axis=0).astype(int)
        dx, dy = (int(offset) for offset in quads.offsets[2 * q : 2 * q + 2])
        page = pages[quads.pages[q]]
        if quads.turned[q]:
            tile = page[x0 + dy : x1 + dy, y0 + dx : y1 + dx].swapaxes(0, 1)
        else:
            tile = page[y0 + dy : y1 + dy, x0 + dx : x1 + dx]
        spot = color[y0:y1, x0:x1]
        free = (spot[..., 3] == 0) & (tile[..., 3] == 255)
        spot[free] = tile[free]
        layer[y0:y1, x0:x1][free] = quads.layers[q]
    return color, layer
