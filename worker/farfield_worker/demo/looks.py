"""Materials and paints of the demo city."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

Rgb = tuple[float, float, float]


class Material(IntEnum):
    """Materials of the file, in its order."""

    PLASTER = 0
    STONE = 1
    PAVING = 2
    EARTH = 3
    THATCH = 4
    WOOD = 5
    WATER = 6
    GRASS = 7
    FOLIAGE = 8
    PAINT = 9
    CLOTH = 10
    DARK = 11
    STUCCO = 12


#: metres that one repeat of a material's texture covers
TILE = {
    Material.PLASTER: 5.0,
    Material.STONE: 3.2,
    Material.PAVING: 4.0,
    Material.EARTH: 6.0,
    Material.THATCH: 2.4,
    Material.WOOD: 2.0,
    Material.WATER: 22.0,
    Material.GRASS: 30.0,
    Material.FOLIAGE: 1.0,
    Material.PAINT: 4.0,
    Material.CLOTH: 2.0,
    Material.DARK: 1.0,
    Material.STUCCO: 6.0,
}


class Look(NamedTuple):
    """How a surface looks and how finely it may be divided.

    Attributes:
        material: what it is made of.
        tint: sRGB colour in [0, 1] that multiplies the texture.
        grain: grid segments per metre at level 1.
        rough: amplitude of its unevenness, metres.
    """

    material: Material
    tint: Rgb = (1.0, 1.0, 1.0)
    grain: float = 0.3
    rough: float = 0.0

    def tinted(self, r: float, g: float, b: float) -> Look:
        """Return the same look in another tint."""
        return self._replace(tint=(r, g, b))

    def shaded(self, factor: float) -> Look:
        """Return the same look, darker or lighter."""
        r, g, b = self.tint
        return self._replace(tint=(min(r * factor, 1), min(g * factor, 1), min(b * factor, 1)))


def rgb(code: str) -> Rgb:
    """Colour of an html code without its hash: `rgb("c0a080")`."""
    r, g, b = (int(code[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return r, g, b


DARK = Look(Material.DARK, rgb("2a1f18"), grain=0.0)
WOOD = Look(Material.WOOD, rgb("dcbc92"), grain=0.35)
OLD_WOOD = Look(Material.WOOD, rgb("a88868"), grain=0.0)
THATCH = Look(Material.THATCH, rgb("e0c890"), grain=0.6)
STONE = Look(Material.STONE, rgb("eee2cc"), grain=0.35, rough=0.015)
RED_STONE = Look(Material.STONE, rgb("d8947c"), grain=0.35, rough=0.015)
ADOBE = Look(Material.PLASTER, rgb("f4ecdc"), grain=0.14)
LIME = Look(Material.STUCCO, rgb("f8f0e0"), grain=0.2)
RED = Look(Material.STUCCO, rgb("b0402c"), grain=0.2)
OCHRE = Look(Material.STUCCO, rgb("d9a04a"), grain=0.2)
TURQUOISE = Look(Material.STUCCO, rgb("46aaa6"), grain=0.2)
BLUE = Look(Material.STUCCO, rgb("4478b4"), grain=0.2)
PAVING = Look(Material.PAVING, rgb("dccfb6"), grain=0.5)
EARTH = Look(Material.EARTH, rgb("d8bf98"), grain=0.5)
CLAY = Look(Material.STUCCO, rgb("b5653c"), grain=0.0)

#: house paints, the commonest first
WALLS = tuple(
    rgb(code)
    for code in (
        *("f3ead8", "efe2c8", "f6f0e2", "ead6b4", "e6cba0", "ecd9bd"),
        *("dcb88a", "e8c4a0", "d9a57c", "e3b79a", "cf9a72", "c98366"),
    )
)
BANDS = tuple(rgb(code) for code in ["a8402c", "b5523a", "2f8a88", "c98a34", "7c3324", "3d6d96"])
CLOTHS = tuple(
    rgb(code)
    for code in (
        *("e8dcc0", "c8452f", "e0a23c", "3a8f93"),
        *("efe6d4", "8d3a55", "d9743c", "5a7f48"),
    )
)
