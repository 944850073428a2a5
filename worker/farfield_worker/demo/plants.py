"""Where everything grows: avenues, courts, gardens, floating gardens, the shore."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.forest import Forest, Species
from farfield_worker.demo.hashing import Dice, uniform
from farfield_worker.demo.land import land_height
from farfield_worker.demo.layout import HALF, HEIGHTS, Ground, Layout, Rect
from farfield_worker.demo.surfaces import linear


class Grow(Protocol):
    """Plant one: species, foot x, y, z, height, spread, its dice."""

    def __call__(
        self,
        species: int,
        x: float,
        y: float,
        z: float,
        height: float,
        spread: float,
        dice: Dice,
        along: tuple[float, float] | None = None,
        weight: float = 1.0,
        /,
    ) -> None:
        """Plant it; `along`: unit vector in x and z; `weight`: see `Forest`."""


def plant(layout: Layout) -> Forest:
    """Plant the whole city: avenues, courts, gardens, chinampas, shore."""
    rows: list[tuple[float, ...]] = []
    wet = layout.classes

    def grow(
        species: int,
        x: float,
        y: float,
        z: float,
        h: float,
        w: float,
        dice: Dice,
        along: tuple[float, float] | None = None,
        weight: float = 1.0,
    ) -> None:
        a = dice.between(-1, 1)
        turn = along or (a, (1 - a * a) ** 0.5)
        warm = dice.between(0.85, 1.15)
        tone = dice.between(0.78, 1.05)
        rows.append(
            (species, x, y, z, h, w, *turn, weight, min(tone * warm, 1.2), tone, tone * 0.9)
        )

    _avenue_trees(grow)
    for k, strip in enumerate(layout.chinampas):
        _garden_bed(grow, strip, Dice(161, k))
    _scattered(grow, wet)
    _shore(grow)
    t = np.array(rows)
    return Forest(
        t[:, 0].astype(np.int64),
        t[:, 1:4],
        t[:, 4],
        t[:, 5],
        t[:, 6:8],
        t[:, 8],
        linear(t[:, 9:12]),
    )


def _avenue_trees(grow: Grow) -> None:
    y = HEIGHTS[Ground.STREET] - 0.02
    for sign in (-1, 1):
        for k in range(26):
            for side in (-1, 1):
                for vertical in (True, False):
                    dice = Dice(171, sign, k, side, int(vertical))
                    z = sign * (124.0 + 8.0 * k)
                    if any(abs(abs(z) - g) < 6.5 for g in (168, 224, 280)) or dice.chance(0.12):
                        continue
                    x = side * (18.6 + dice.between(-0.3, 0.3))
                    h = dice.between(7.0, 10.5)
                    spot = (x, z) if vertical else (z, x)
                    grow(Species.WILLOW, spot[0], y, spot[1], h, h * dice.between(0.19, 0.25), dice)


def _garden_bed(grow: Grow, strip: Rect, dice: Dice) -> None:
    """Crops in rows along a chinampa, willows at its corners."""
    y = HEIGHTS[Ground.CHINAMPA]
    along_x = strip.width > strip.depth
    length = max(strip.width, strip.depth)
    wide = min(strip.width, strip.depth)
    crop = dice.pick((Species.MAIZE, Species.MAIZE, Species.FLOWERS, Species.FLOWERS))
    tall = dice.between(1.6, 2.1) if crop == Species.MAIZE else dice.between(0.45, 0.8)
    bed, sections = 3, 2
    for r in range(bed):
        o = (r + 0.5) / bed * (wide - 1.4) + 0.7
        for q in range(sections):
            if dice.chance(0.04):
                continue
            m = 2.5 + (q + 0.5) * (length - 5.0) / sections
            half = (length - 5.0) / sections / 2 * 0.97
            x, z = (strip.x0 + m, strip.z0 + o) if along_x else (strip.x0 + o, strip.z0 + m)
            grow(
                crop,
                x,
                y,
                z,
                tall * dice.between(0.85, 1.1),
                half,
                dice,
                (1.0, 0.0) if along_x else (0.0, 1.0),
            )
    for end in (0.6, length - 0.6, length / 2):
        for side in (0.5, wide - 0.5):
            if dice.chance(0.45):
                x, z = (
                    (strip.x0 + end, strip.z0 + side)
                    if along_x
                    else (strip.x0 + side, strip.z0 + end)
                )
                h = dice.between(6.0, 10.0)
                grow(Species.WILLOW, x, y - 0.02, z, h, h * dice.between(0.17, 0.23), dice)


def _scattered(grow: Grow, classes: NDArray[np.uint8]) -> None:
    """Trees and bushes in courts and gardens."""
    spots = -340 + 680 * uniform(182, np.arange(26000)[:, None], np.arange(2)[None])
    i, j = (spots + HALF).astype(np.int64).T
    kinds = classes[j, i]
    clear = (kinds > Ground.CANAL) & (kinds != Ground.BUILT)
    for a, b in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)):
        clear &= classes[j + a, i + b] == kinds
    for k in np.flatnonzero(clear):
        dice = Dice(181, int(k))
        x, z = float(spots[k, 0]), float(spots[k, 1])
        kind = int(kinds[k])
        y = HEIGHTS[kind] - 0.02
        if (kind == Ground.COURT and dice.chance(0.16)) or (
            kind == Ground.GARDEN and dice.chance(0.34)
        ):
            _court_plant(grow, x, y, z, dice)
        elif kind == Ground.STREET and dice.chance(0.012):
            grow(Species.BROAD, x, y, z, dice.between(4.5, 6.5), dice.between(1.6, 2.2), dice)


def _court_plant(grow: Grow, x: float, y: float, z: float, dice: Dice) -> None:
    kind = dice.whole(0, 9)
    if kind <= 2:
        h = dice.between(4.5, 8.0)
        grow(Species.BROAD, x, y, z, h, h * dice.between(0.3, 0.4), dice)
    elif kind == 3 and dice.chance(0.6):
        grow(Species.PALM, x, y, z, dice.between(5.5, 9.0), dice.between(2.2, 2.9), dice)
    elif kind <= 7:
        h = dice.between(0.9, 1.8)
        grow(Species.BUSH, x, y, z, h, h * 0.62, dice)
    else:
        grow(Species.AGAVE, x, y, z, dice.between(0.8, 1.5), dice.between(0.6, 0.9), dice)


def _shore(grow: Grow) -> None:
    """Woods and reeds on the land around the lake, each picture facing the city."""
    for k in range(680):
        dice = Dice(191, k)
        x, z = dice.between(-655, 655), dice.between(-655, 655)
        if x * x + z * z < 540 * 540:
            continue
        count = dice.whole(1, 5)
        xs = np.array([x + dice.between(-9, 9) for _ in range(count)])
        zs = np.array([z + dice.between(-9, 9) for _ in range(count)])
        spots = zip(xs.tolist(), land_height(xs, zs).tolist(), zs.tolist(), strict=True)
        for px, y, pz in spots:
            if not 0.1 < y < 80 or abs(px) < 12 or abs(pz) < 12:
                continue
            r = (px * px + pz * pz) ** 0.5
            across = (-pz / r, px / r)
            if y < 0.5:
                h, w = dice.between(1.0, 1.8), dice.between(0.9, 1.3)
                grow(Species.AGAVE, px, y - 0.1, pz, h, w, dice, across, 0.3)
            elif dice.chance(0.8):
                h = dice.between(5.0, 9.5)
                grow(
                    Species.BROAD,
                    px,
                    y - 0.2,
                    pz,
                    h,
                    h * dice.between(0.32, 0.45),
                    dice,
                    across,
                    0.3,
                )
            else:
                h = dice.between(7.0, 12.0)
                grow(
                    Species.WILLOW,
                    px,
                    y - 0.2,
                    pz,
                    h,
                    h * dice.between(0.18, 0.24),
                    dice,
                    across,
                    0.3,
                )
