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
REFERENCE_TRIANGLES = 877_000

#: One cell of a dense city, 877k triangles, 512 texels, 64 layers, four faces, two CPU cores.
#: Exponents: layers from the same city at 328 layers, texels from 1024 texels, triangles from the
#: floor of the culled draw loop.
COSTS = {
    "seconds": _Cost(value=0.82, layers=0.8, texels=0.8, triangles=0.5),
    "bytes": _Cost(value=779e3, layers=0.77, texels=1.5, triangles=0.0),
    "quads": _Cost(value=18.0e3, layers=0.96, texels=1.0, triangles=0.0),
}
#: bytes of a quad in a cell's file, gzip left out
QUAD_BYTES = 70.0


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
