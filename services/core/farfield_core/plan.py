"""What a bake will come to, before anything is rendered: fast enough to follow a drag."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict

from farfield_core.corridor import Corridor, box_shape, cut
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings


class Plan(BaseModel):
    """What a bake will come to; megabytes, seconds and quads are estimates.

    Attributes:
        cells: number of view cells.
        near_field: half width of the near-field cube, metres.
        layers: number of layers.
        megabytes: atlas pages and cell files, 10^6 bytes.
        seconds: work of one process; divide by the number of processes.
        quads: quads of a cell.
    """

    model_config = ConfigDict(frozen=True)

    cells: int
    near_field: float
    layers: int
    megabytes: float
    seconds: float
    quads: float


class _Cost(NamedTuple):
    """A cost of one cell: `value` at the reference, growing as powers of what it depends on."""

    value: float
    layers: float
    texels: float
    triangles: float

    def of(self, layers: int, resolution: int, triangles: int) -> float:
        """Cost under other settings."""
        return float(
            self.value
            * (layers / REFERENCE_LAYERS) ** self.layers
            * (resolution / REFERENCE_RESOLUTION) ** self.texels
            * max(triangles / REFERENCE_TRIANGLES, 0.01) ** self.triangles
        )


REFERENCE_LAYERS = 64
REFERENCE_RESOLUTION = 512
REFERENCE_TRIANGLES = 850_000

#: One cell of the demo city, 14 m, 512 texels, 64 layers, by one process on a CPU without a GPU:
#: means over two to twelve cells of its avenue. Exponents of layers between 16 and 64 layers and
#: (on a prototype) 328, those of texels between 256, 512 and 1024. How seconds depend on layers,
#: texels and triangles is that of a prototype's renderer.
COSTS = {
    "seconds": _Cost(value=1.5, layers=0.8, texels=0.8, triangles=0.5),
    "bytes": _Cost(value=1.15e6, layers=0.9, texels=0.85, triangles=0.0),
    "quads": _Cost(value=20.1e3, layers=1.2, texels=0.8, triangles=0.0),
}
#: bytes of a quad in a cell's file, before the server compresses it
QUAD_BYTES = 106.0


def plan(scene: SceneInfo, corridor: Corridor, settings: BakeSettings) -> Plan:
    """Plan a bake; raises BadInputError as `create_bake` would."""
    if corridor.box is not None:
        size = np.asarray(settings.cell_size, np.float64)
        nx, ny, nz = box_shape(corridor.box, size, corridor.follow_ground)
        cells = nx * ny * nz
    else:
        cells = len(cut(corridor, settings.cell_size))
    placement = settings.place()
    layers = len(placement.layers)
    cost = {name: c.of(layers, settings.resolution, scene.triangles) for name, c in COSTS.items()}
    return Plan(
        cells=cells,
        near_field=placement.near_field,
        layers=layers,
        megabytes=cells * (cost["bytes"] + cost["quads"] * QUAD_BYTES) / 1e6,
        seconds=cells * cost["seconds"],
        quads=cost["quads"],
    )
