"""What a bake will come to, before anything is rendered: fast enough to follow a drag."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from farfield_core.cells import CellGrid
from farfield_core.corridor import Corridor, box_shape, cut
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.validation import Alike
from farfield_core.walk import OVERLAP

Floats = NDArray[np.float64]


class Plan(BaseModel):
    """What a bake will come to; all but cells, near field and layers are estimates.

    What a cell has is told with what no eye in it can see left out, as settings ask; `before` is
    the same for visibility off.

    Attributes:
        cells: number of view cells.
        cell_size: their edge lengths, metres.
        near_field: half width of the near-field cube, metres.
        layers: number of layers, 0 where quads are slanted.
        megabytes: atlas pages and cell files, 10^6 bytes.
        seconds: work of one process; divide by the number of processes.
        quads: quads of a cell.
        texels: far texels stored for a cell.
        kilobytes: atlas pages and file of a cell, 10^3 bytes.
        near_triangles: near triangles listed in a cell, the mean over the corridor.
        most_near_triangles: the same of the cell that has most.
        why: how a budget was kept; empty without one.
        before: `quads`, `texels`, `kilobytes`, `near_triangles` and `most_near_triangles` without
            visibility.
    """

    model_config = ConfigDict(frozen=True)

    cells: int
    cell_size: Annotated[tuple[float, float, float], Alike()]
    near_field: float
    layers: int
    megabytes: float
    seconds: float
    quads: float
    texels: float
    kilobytes: float
    near_triangles: float
    most_near_triangles: float
    before: dict[str, float]
    why: str = ""


class Choice(NamedTuple):
    """Settings that leave nothing open, and what they come to."""

    settings: BakeSettings
    plan: Plan


class _Cost(NamedTuple):
    """A cost of one cell: `value` at the reference, growing as powers of what it depends on."""

    value: float
    layers: float
    texels: float
    triangles: float

    def of(self, layers: float, resolution: int, triangles: int) -> float:
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
#: layers, visibility off: means over two to twelve cells of its avenue; seconds are processor time,
#: without a GPU. Exponents: for layers from 16 and 200 layers (slanted: the near field that 200
#: layers have), for texels of layers from 256 and 1024. What slanted quads cost at other
#: resolutions, and how seconds depend on anything, is that of a prototype.
COSTS: dict[str, dict[str, _Cost]] = {
    "layers": {
        "seconds": _Cost(value=0.9, layers=0.8, texels=0.8, triangles=0.5),
        "bytes": _Cost(value=1.08e6, layers=0.9, texels=0.85, triangles=0.0),
        "quads": _Cost(value=17.6e3, layers=1.2, texels=0.8, triangles=0.0),
        "texels": _Cost(value=356e3, layers=0.9, texels=2.0, triangles=0.0),
    },
    "slanted": {
        "seconds": _Cost(value=4.6, layers=0.1, texels=0.8, triangles=0.3),
        "bytes": _Cost(value=1.38e6, layers=0.44, texels=0.85, triangles=0.0),
        "quads": _Cost(value=3.4e3, layers=0.5, texels=0.77, triangles=0.0),
        "texels": _Cost(value=532e3, layers=0.44, texels=2.0, triangles=0.0),
    },
}
#: what visibility leaves of them, same cells; streets and rooms have less left, see
#: docs/near-field.md
SEEN: dict[str, dict[str, float]] = {
    "layers": {"seconds": 1.9, "bytes": 0.79, "quads": 0.84, "texels": 0.77},
    "slanted": {"seconds": 1.06, "bytes": 0.71, "quads": 0.97, "texels": 0.65},
}
#: near triangles that some eye sees, as a share of those inside
SEEN_NEAR = 0.56
#: bytes of a quad in a cell's file, before the server compresses it
QUAD_BYTES = {"layers": 106.0, "slanted": 144.0}
#: cells whose near triangles are estimated, unless asked otherwise
SAMPLED = 64


def plan(
    scene: SceneInfo, corridor: Corridor, settings: BakeSettings, sampled: int = SAMPLED
) -> Plan:
    """Plan a bake with just these settings, whatever their budget (`choice.choose`).

    Near triangles are those of `sampled` cells. Raises BadInputError as `create_bake` would.
    """
    cells, centres = _some_cells(corridor, settings.cell_size, sampled)
    layers = settings.layers_alike
    inside = near_triangles(scene, centres, settings.near_field * OVERLAP)
    before = {
        name: c.of(layers, settings.resolution, scene.triangles)
        for name, c in COSTS[settings.quads].items()
    }
    left = SEEN[settings.quads] if settings.visibility != "off" else dict.fromkeys(before, 1.0)
    near_left = SEEN_NEAR if settings.visibility != "off" else 1.0
    cost = {name: value * left[name] for name, value in before.items()}
    kilobytes = _kilobytes(cost, settings)
    return Plan(
        cells=cells,
        cell_size=settings.cell_size,
        near_field=settings.near_field,
        layers=round(layers) if settings.quads == "layers" else 0,
        megabytes=cells * kilobytes / 1e3,
        seconds=cells * cost["seconds"],
        quads=cost["quads"],
        texels=cost["texels"],
        kilobytes=kilobytes,
        near_triangles=float(inside.mean()) * near_left,
        most_near_triangles=float(inside.max()) * near_left,
        before={
            "quads": before["quads"],
            "texels": before["texels"],
            "kilobytes": _kilobytes(before, settings),
            "near_triangles": float(inside.mean()),
            "most_near_triangles": float(inside.max()),
        },
    )


def _kilobytes(cost: dict[str, float], settings: BakeSettings) -> float:
    """Atlas pages and file of a cell, 10^3 bytes."""
    return (cost["bytes"] + cost["quads"] * QUAD_BYTES[settings.quads]) / 1e3


def near_triangles(scene: SceneInfo, centres: Floats, half_width: float) -> Floats:
    """Estimated triangles in the cubes of `half_width` around `centres` (n, 3): (n,) float.

    Each block counts with the share of its bounds that lies inside.
    """
    if not scene.blocks:
        return np.zeros(len(centres))
    low = np.array([block.low for block in scene.blocks]) + scene.origin
    high = np.array([block.high for block in scene.blocks]) + scene.origin
    count = np.array([float(block.triangles) for block in scene.blocks])
    share = np.ones((len(centres), len(count)))
    for axis in range(3):
        c = centres[:, axis, None]
        thickness = np.maximum(high[:, axis] - low[:, axis], 1e-9)
        inside = np.minimum(high[:, axis] + 1e-9, c + half_width) - np.maximum(
            low[:, axis], c - half_width
        )
        share *= np.clip(inside / thickness, 0.0, 1.0)
    return np.asarray(share @ count)


@lru_cache(maxsize=4)
def _some_cells(
    corridor: Corridor, cell_size: tuple[float, float, float], sampled: int
) -> tuple[int, Floats]:
    """Number of cells, and the centres of some of them, (n, 3) float."""
    size = np.asarray(cell_size, np.float64)
    if corridor.box is not None:
        shape = np.array(box_shape(corridor.box, size, corridor.follow_ground))
        return int(shape.prod()), _some_of_box(np.asarray(corridor.box.min), shape, size, sampled)
    grid = cut(corridor, cell_size)
    return len(grid), _some_of_grid(grid, sampled)


def _some_of_box(low: Floats, shape: NDArray[np.int64], size: Floats, sampled: int) -> Floats:
    """Centres of some cells of a box, evenly spread: (n, 3) float."""
    chosen = np.linspace(0, int(shape.prod()) - 1, min(sampled, int(shape.prod()))).astype(np.int64)
    index = np.stack(np.unravel_index(chosen, tuple(shape.tolist())), axis=1)
    return np.asarray(low + (index + 0.5) * size, np.float64)


def _some_of_grid(grid: CellGrid, sampled: int) -> Floats:
    """Centres of some cells of a grid, evenly spread: (n, 3) float."""
    chosen = np.linspace(0, len(grid) - 1, min(sampled, len(grid))).astype(np.int64)
    return np.asarray(grid.centres()[chosen], np.float64)
