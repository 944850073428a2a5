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
        layers: number of layers, 0 where quads are slanted.
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

#: One cell of the demo city, 14 m, 512 texels, 64 layers or slanted quads with the near field of 64
#: layers: means over two to twelve cells of its avenue; seconds are processor time, without a GPU.
#: Exponents: for layers from 16 and 200 layers (slanted: the near field that 200 layers have), for
#: texels of layers from 256 and 1024. What slanted quads cost at other resolutions, and how seconds
#: depend on anything, is that of a prototype.
COSTS: dict[str, dict[str, _Cost]] = {
    "layers": {
        "seconds": _Cost(value=0.9, layers=0.8, texels=0.8, triangles=0.5),
        "bytes": _Cost(value=1.15e6, layers=0.9, texels=0.85, triangles=0.0),
        "quads": _Cost(value=20.1e3, layers=1.2, texels=0.8, triangles=0.0),
    },
    "slanted": {
        "seconds": _Cost(value=3.9, layers=0.1, texels=0.8, triangles=0.3),
        "bytes": _Cost(value=0.93e6, layers=0.44, texels=0.85, triangles=0.0),
        "quads": _Cost(value=3.3e3, layers=0.5, texels=0.77, triangles=0.0),
    },
}
#: bytes of a quad in a cell's file, before the server compresses it
QUAD_BYTES = {"layers": 106.0, "slanted": 144.0}


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
    cost = {
        name: c.of(layers, settings.resolution, scene.triangles)
        for name, c in COSTS[settings.quads].items()
    }
    return Plan(
        cells=cells,
        near_field=settings.near_field,
        layers=layers if settings.quads == "layers" else 0,
        megabytes=cells * (cost["bytes"] + cost["quads"] * QUAD_BYTES[settings.quads]) / 1e6,
        seconds=cells * cost["seconds"],
        quads=cost["quads"],
    )
