"""The parts of the city, their shares of the triangles, and the level that gives a wanted number.

Each part has a fixed share, and a level of its own, found by bisection, at which it has its share
of the wanted number; so the near and the far, walls and leaves grow alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo import ground
from farfield_worker.demo.forest import Forest
from farfield_worker.demo.houses import houses
from farfield_worker.demo.layout import plan
from farfield_worker.demo.lighting import CELL, HeightMap
from farfield_worker.demo.plants import plant
from farfield_worker.demo.sketch import Sketch
from farfield_worker.demo.surfaces import Surfaces, concatenate
from farfield_worker.demo.temples import temples
from farfield_worker.demo.tessellate import divisions, triangle_count
from farfield_worker.demo.waterside import waterside

Counts = NDArray[np.int64]

#: part -> share of all triangles; what one part misses its share by the later ones make good
SHARES = {
    "temples": 0.15,
    "plants": 0.20,
    "houses": 0.40,
    "waterside": 0.04,
    "ground": 0.13,
    "land": 0.04,
    "water": 0.04,
}


@dataclass(frozen=True)
class City:
    """Everything that does not depend on the number of triangles."""

    tables: dict[str, Surfaces]
    forest: Forest
    map: HeightMap


def build() -> City:
    """Draw the whole city."""
    layout = plan()
    sketches = {
        name: Sketch(900 + k, spread=name in ("temples", "waterside"))
        for k, name in enumerate(SHARES)
    }
    houses(sketches["houses"], layout)
    temples(sketches["temples"], layout)
    waterside(sketches["waterside"], layout)
    forest = plant(layout)
    tables = {name: s.surfaces() for name, s in sketches.items() if s.has_content()}
    tables["land"] = ground.land()
    tables["water"] = ground.water(layout)
    tables["ground"] = concatenate([ground.floors(layout), ground.quays(layout)])
    solids = [row for s in sketches.values() for row in s.solids] + forest.solids()
    heights = HeightMap(ground.heights(layout.classes, CELL), np.array(solids))
    return City(tables, forest, heights)


def select(city: City, triangles: int) -> tuple[Surfaces, Counts, Counts, dict[str, int]]:
    """Surfaces that exist, their cells along u and v, and the triangles of each part."""
    chosen, us, vs = [], [], []
    counts: dict[str, int] = {}
    left, shares = float(triangles), sum(SHARES.values())
    for name, share in SHARES.items():
        wanted = left * share / shares
        table = city.forest.surfaces(city.forest.level(wanted)) if name == "plants" else None
        if table is None:
            whole = city.tables[name]
            level = _level(lambda at, t=whole: triangle_count(t, at), wanted)  # type: ignore[misc]
            nu, nv = divisions(whole, level)
            keep = np.flatnonzero(nu > 0)
            table, nu, nv = whole.take(keep), nu[keep], nv[keep]
        else:
            nu, nv = divisions(table, 1.0)
        counts[name] = int(2 * (nu * nv).sum())
        left -= counts[name]
        shares -= share
        chosen.append(table)
        us.append(nu)
        vs.append(nv)
    return concatenate(chosen), np.concatenate(us), np.concatenate(vs), counts


def _level(count: Callable[[float], int], wanted: float) -> float:
    """The level at which `count` comes closest to what is wanted."""
    low, high = 0.01, 40.0
    for _ in range(28):
        middle = (low * high) ** 0.5
        if count(middle) < wanted:
            low = middle
        else:
            high = middle
    return low if abs(count(low) - wanted) < abs(count(high) - wanted) else high
