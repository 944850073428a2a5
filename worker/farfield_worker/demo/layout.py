"""The plan of the city: island, blocks, canals, streets, precinct, causeways, floating gardens.

Everything is painted into a map of classes, one cell a square metre, that `ground` turns into
surfaces; houses stand where blocks were divided into parcels.  x runs east, z south; the great
avenue runs along x = 0 from the south gate of the precinct to the southern shore.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.land import EXTENT

PITCH = 56
HALF = int(EXTENT)
#: half width of the sacred precinct, metres
PRECINCT = 106
AVENUE = 10
SIDE_CANAL = (AVENUE, AVENUE + 7)
CAUSEWAY = 7
CAUSEWAY_END = 592
#: where causeways open to let boats through
GAPS = (372, 444, 516)


class Ground(IntEnum):
    """Classes of the map."""

    WATER = 0
    CANAL = 1
    STREET = 2
    AVENUE = 3
    PLAZA = 4
    MARKET = 5
    COURT = 6
    BUILT = 7
    CAUSEWAY = 8
    CHINAMPA = 9
    GARDEN = 10
    LANE = 11


#: height of each class above the lake, metres
HEIGHTS = (0.0, 0.0, 1.2, 1.3, 2.0, 1.5, 1.2, 1.2, 1.6, 0.55, 1.2, 1.3)


class Rect(NamedTuple):
    """x0, z0, x1, z1, metres."""

    x0: float
    z0: float
    x1: float
    z1: float

    @property
    def width(self) -> float:
        """Extent along x."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Extent along z."""
        return self.z1 - self.z0

    def inset(self, d: float) -> Rect:
        """Return the rectangle, smaller by d on every side."""
        return Rect(self.x0 + d, self.z0 + d, self.x1 - d, self.z1 - d)


class Parcel(NamedTuple):
    """Ground for one house; `front` is the side with the door: 0 south, 1 east, 2 north, 3 west."""

    area: Rect
    front: int
    rim: bool


class Bridge(NamedTuple):
    """A deck over water; it runs along x or z."""

    area: Rect
    along_x: bool
    height: float


Block = tuple[int, int]

_SUPER: dict[Block, str] = {}
for _i in range(-2, 2):
    for _j in range(-2, 2):
        _SUPER[_i, _j] = "precinct"
for _i, _j, _name in (
    *((i, j, "market") for i in (-2, -1) for j in (2,)),
    *((i, j, "palace") for i in (0, 1) for j in (2,)),
    *((i, j, "old palace") for i in (-4, -3) for j in (-1, 0)),
    *((i, j, "garden") for i in (2, 3) for j in (-1, 0)),
):
    _SUPER[_i, _j] = _name
_SHRINES = {(-3, 3), (3, 2), (1, 4), (-5, 1), (4, -3), (-2, -4), (2, -5), (-4, -3), (-1, 5)}


def on_island(block: Block) -> bool:
    """Is the block part of the island?"""
    i, j = block
    inside = -6 <= i <= 5 and -6 <= j <= 5
    return inside and abs(i + 0.5) + abs(j + 0.5) <= 9


@dataclass
class Layout:
    """The plan; `classes` is (2 HALF, 2 HALF) uint8, rows along z."""

    classes: NDArray[np.uint8] = field(
        default_factory=lambda: np.zeros((2 * HALF, 2 * HALF), np.uint8)
    )
    parcels: list[Parcel] = field(default_factory=list)
    bridges: list[Bridge] = field(default_factory=list)
    shrines: list[Rect] = field(default_factory=list)
    chinampas: list[Rect] = field(default_factory=list)
    places: dict[str, Rect] = field(default_factory=dict)

    def paint(self, area: Rect, ground: Ground) -> None:
        """Fill the cells of a rectangle of whole metres."""
        x0, z0, x1, z1 = (round(c) + HALF for c in area)
        self.classes[max(z0, 0) : max(z1, 0), max(x0, 0) : max(x1, 0)] = ground

    def wet(self, area: Rect) -> bool:
        """Is the middle of an area water?"""
        x, z = (area.x0 + area.x1) / 2, (area.z0 + area.z1) / 2
        return bool(self.classes[int(z) + HALF, int(x) + HALF] <= Ground.CANAL)

    def cover(self, area: Rect) -> None:
        """Take away the ground where a building stands on whole cells."""
        x0, z0 = np.ceil(area.x0 + 0.02), np.ceil(area.z0 + 0.02)
        x1, z1 = np.floor(area.x1 - 0.02), np.floor(area.z1 - 0.02)
        if x1 > x0 and z1 > z0:
            self.paint(Rect(x0, z0, x1, z1), Ground.BUILT)


def plan() -> Layout:
    """Draw up the city."""
    layout = Layout()
    blocks = [(i, j) for j in range(-6, 6) for i in range(-6, 6) if on_island((i, j))]
    for i, j in blocks:
        layout.paint(Rect(PITCH * i, PITCH * j, PITCH * (i + 1), PITCH * (j + 1)), Ground.STREET)
    _canals(layout, blocks)
    _avenues(layout)
    for name, ground in (("precinct", Ground.PLAZA), ("market", Ground.MARKET)):
        layout.paint(_super_area(name), ground)
    for name in ("precinct", "market", "palace", "old palace", "garden"):
        layout.places[name] = _super_area(name)
    layout.paint(_super_area("garden"), Ground.GARDEN)
    for block in blocks:
        if block not in _SUPER:
            _divide(layout, block)
    _causeways(layout)
    _chinampas(layout)
    layout.bridges = [b for b in layout.bridges if layout.wet(b.area)]
    return layout


def _edge(a: Block, b: Block, line: int, across: int) -> int:
    """Half width of what lies between two blocks on a grid line; 0 inside one place."""
    if _SUPER.get(a) is not None and _SUPER.get(a) == _SUPER.get(b):
        return 0
    if not (on_island(a) and on_island(b)):
        return 4
    if line == 0 and not -2 <= across < 2:
        return 21
    return 7 if line % 2 else 3


def _block_area(block: Block) -> Rect:
    i, j = block
    return Rect(
        PITCH * i + _edge((i - 1, j), block, i, j),
        PITCH * j + _edge((i, j - 1), block, j, i),
        PITCH * (i + 1) - _edge(block, (i + 1, j), i + 1, j),
        PITCH * (j + 1) - _edge(block, (i, j + 1), j + 1, i),
    )


def _super_area(name: str) -> Rect:
    if name == "precinct":
        return Rect(-PRECINCT, -PRECINCT, PRECINCT, PRECINCT)
    areas = [_block_area(b) for b, n in _SUPER.items() if n == name]
    return Rect(
        min(a.x0 for a in areas),
        min(a.z0 for a in areas),
        max(a.x1 for a in areas),
        max(a.z1 for a in areas),
    )


def _canals(layout: Layout, blocks: list[Block]) -> None:
    for i, j in blocks:
        for other, vertical in (((i - 1, j), True), ((i, j - 1), False)):
            line = i if vertical else j
            across = j if vertical else i
            if line % 2 == 0 or not on_island(other):
                continue
            if _edge(other, (i, j), line, across) != 7:
                continue
            c, a, b = PITCH * line, PITCH * across, PITCH * (across + 1)
            strip = Rect(c - 4, a, c + 4, b) if vertical else Rect(a, c - 4, b, c + 4)
            layout.paint(strip, Ground.CANAL)
            if across % 2 == 0 and across != 0:  # a street crosses here
                e = PITCH * across
                deck = Rect(c - 4, e - 2, c + 4, e + 2)
                if not vertical:
                    deck = Rect(e - 2, c - 4, e + 2, c + 4)
                layout.bridges.append(Bridge(deck, vertical, 1.2))
            # a plank bridge somewhere along the canal
            dice = Dice(51, i, j, int(vertical))
            if dice.chance(0.7):
                m = a + dice.whole(14, 40)
                plank = Rect(c - 4, m, c + 4, m + 2) if vertical else Rect(m, c - 4, m + 2, c + 4)
                layout.bridges.append(Bridge(plank, vertical, 1.2))


def _avenues(layout: Layout) -> None:
    edge = 6 * PITCH
    start = 2 * PITCH + 3
    low, high = SIDE_CANAL
    for sign in (-1, 1):
        for vertical in (True, False):
            a, b = sorted((sign * (2 * PITCH), sign * edge))
            road = Rect(-AVENUE, a, AVENUE, b) if vertical else Rect(a, -AVENUE, b, AVENUE)
            layout.paint(road, Ground.AVENUE)
            for lane in (-5, 4):
                edge_line = Rect(lane, a, lane + 1, b) if vertical else Rect(a, lane, b, lane + 1)
                layout.paint(edge_line, Ground.LANE)
            a, b = sorted((sign * start, sign * edge))
            for side in (-1, 1):
                c, d = sorted((side * low, side * high))
                strip = Rect(c, a, d, b) if vertical else Rect(a, c, b, d)
                layout.paint(strip, Ground.CANAL)
                e = sign * PITCH * 4  # the street leads over the side canal
                deck = Rect(c, e - 2, d, e + 2) if vertical else Rect(e - 2, c, e + 2, d)
                layout.bridges.append(Bridge(deck, vertical, 1.25))
                for m in (2.5, 3.5, 4.5, 5.5):
                    e = round(sign * PITCH * m) + 6 * side
                    deck = Rect(c, e - 1, d, e + 1) if vertical else Rect(e - 1, c, e + 1, d)
                    layout.bridges.append(Bridge(deck, vertical, 1.25))
            for line in (3, 5):
                e = sign * PITCH * line
                cross = (
                    Rect(-AVENUE, e - 4, AVENUE, e + 4)
                    if vertical
                    else Rect(e - 4, -AVENUE, e + 4, AVENUE)
                )
                if _crosses(line * sign, vertical):
                    layout.paint(cross, Ground.CANAL)
                    layout.bridges.append(Bridge(cross.inset(0), not vertical, 1.3))


def _crosses(line: int, vertical: bool) -> bool:
    """Does a canal on this line reach the avenue?"""
    j = line if line > 0 else line - 1
    sides = [(-1, j), (0, j)] if vertical else [(j, -1), (j, 0)]
    return all(_SUPER.get(block) is None for block in sides)


def _divide(layout: Layout, block: Block) -> None:
    area = _block_area(block)
    if block in _SHRINES:
        layout.shrines.append(area)
        return
    i, j = block
    rim = any(not on_island((i + a, j + b)) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)))
    dice = Dice(61, i, j)
    pieces = [area]
    done: list[Rect] = []
    while pieces:
        piece = pieces.pop()
        long_x = piece.width >= piece.depth
        extent = piece.width if long_x else piece.depth
        if extent <= 21 or (extent <= 25 and dice.chance(0.8)):
            done.append(piece)
            continue
        cut = round(extent * dice.between(0.42, 0.58))
        if long_x:
            m = piece.x0 + cut
            pieces += [Rect(piece.x0, piece.z0, m, piece.z1), Rect(m, piece.z0, piece.x1, piece.z1)]
        else:
            m = piece.z0 + cut
            pieces += [Rect(piece.x0, piece.z0, piece.x1, m), Rect(piece.x0, m, piece.x1, piece.z1)]
    for piece in done:
        fronts = [
            side
            for side, gap in enumerate(
                (
                    area.z1 - piece.z1,
                    area.x1 - piece.x1,
                    piece.z0 - area.z0,
                    piece.x0 - area.x0,
                )
            )
            if gap < 0.5
        ]
        front = dice.pick(fronts) if fronts else dice.whole(0, 3)
        if rim and dice.chance(0.1):
            layout.paint(piece, Ground.GARDEN)
        layout.parcels.append(Parcel(piece, front, rim))


def _causeways(layout: Layout) -> None:
    edge = 6 * PITCH
    for sign in (-1, 1):
        for vertical in (True, False):
            stops = (edge, *[g for gap in GAPS for g in (gap - 4, gap + 4)], CAUSEWAY_END)
            for start, stop in zip(stops[::2], stops[1::2], strict=True):
                a, b = sorted((sign * start, sign * stop))
                w = CAUSEWAY
                layout.paint(Rect(-w, a, w, b) if vertical else Rect(a, -w, b, w), Ground.CAUSEWAY)
            for gap in GAPS:
                a, b = sorted((sign * (gap - 4), sign * (gap + 4)))
                w = CAUSEWAY - 2
                deck = Rect(-w, a, w, b) if vertical else Rect(a, -w, b, w)
                layout.bridges.append(Bridge(deck, not vertical, 1.6))


def _chinampas(layout: Layout) -> None:
    """Strips of garden in the shallows around the island, in bundles of one direction."""
    edge = 6 * PITCH
    for bi in range(-9, 9):
        for bj in range(-9, 9):
            x, z = bi * 54.0, bj * 54.0
            dice = Dice(71, bi, bj)
            along_x = dice.chance(0.5)
            if dice.chance(0.14):
                continue
            count, length, width, gap = 5, 45, 7, 4
            for k in range(count):
                o = 3 + k * (width + gap)
                strip = (
                    Rect(x + 4, z + o, x + 4 + length, z + o + width)
                    if along_x
                    else Rect(x + o, z + 4, x + o + width, z + 4 + length)
                )
                if dice.chance(0.06) or not _floats(strip, edge):
                    continue
                layout.chinampas.append(strip)
                layout.paint(strip, Ground.CHINAMPA)


def _floats(strip: Rect, edge: int) -> bool:
    """Does a garden lie in open water: off the island, off the causeways, off the deep?"""
    for x in (strip.x0, strip.x1):
        for z in (strip.z0, strip.z1):
            if abs(x) < 26 or abs(z) < 26 or x * x + z * z > 470.0**2:
                return False
            i, j = int(np.floor(x / PITCH)), int(np.floor(z / PITCH))
            for a in (-8, 8):
                for b in (-8, 8):
                    i, j = int(np.floor((x + a) / PITCH)), int(np.floor((z + b) / PITCH))
                    if on_island((i, j)):
                        return False
    return abs(strip.x0) < edge + 120 and abs(strip.z0) < edge + 120
