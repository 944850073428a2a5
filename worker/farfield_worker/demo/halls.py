"""Halls behind rows of pillars, palaces made of them, and the shrines of the quarters."""

from __future__ import annotations

from farfield_worker.demo.friezes import DISKS, STEPPED_FRET
from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.layout import HEIGHTS, Ground, Layout, Rect
from farfield_worker.demo.looks import (
    BANDS,
    DARK,
    LIME,
    OCHRE,
    OLD_WOOD,
    PAVING,
    RED,
    RED_STONE,
    STONE,
    TURQUOISE,
    WALLS,
    rgb,
)
from farfield_worker.demo.pyramids import Pyramid, pyramid
from farfield_worker.demo.shrines import around, banner, crest, frieze
from farfield_worker.demo.sketch import (
    CLOSED,
    NORTH,
    SOUTH,
    STANDING,
    Place,
    Sketch,
)
from farfield_worker.demo.surfaces import ENDLESS

ROOF = LIME.tinted(*rgb("e8d8b8"))


def hall(s: Sketch, at: Place, w: float, d: float, tall: float, dice: Dice) -> None:
    """A long hall on a low platform behind a row of pillars; its front is +z."""
    platform = 1.4
    s.box((-w - 1, -1.3, -d - 1), (w + 1, platform, d + 1), STONE, at=at, top=PAVING, taper=0.2)
    for k in range(4):
        half = 4 - 0.05 * k
        s.box(
            (-half, -1.2, d),
            (half, platform * (k + 1) / 5, d + 2.9 - k * 0.5),
            LIME,
            at=at,
            top=PAVING,
            faces=STANDING & ~NORTH,
        )
    wall = LIME.tinted(*dice.pick(WALLS[:6]))
    s.box((-w, platform - 0.1, -d), (w, platform + tall, d - 3.0), wall, at=at, solid=True)
    s.box((-w, platform + tall * 0.74, d - 3.0), (w, platform + tall, d), wall, at=at, faces=CLOSED)
    count = max(4, int(2 * w / 3.0))
    paint = (RED, TURQUOISE, OCHRE)[dice.whole(0, 2)]
    for k in range(count):
        x = -w + 0.5 + k * (2 * w - 1.0) / (count - 1)
        s.box(
            (x - 0.4, platform - 0.1, d - 0.95),
            (x + 0.4, platform + tall * 0.75, d - 0.15),
            paint,
            at=at,
            levels=(0.12, ENDLESS),
        )
        s.box(
            (x - 0.55, platform - 0.1, d - 1.1),
            (x + 0.55, platform + 0.4, d),
            LIME,
            at=at,
            levels=(0.5, ENDLESS),
        )
        if k < count - 1 and k % 2 == 0:
            c = x + (2 * w - 1.0) / (count - 1) / 2
            s.box(
                (c - 0.7, platform, d - 3.3),
                (c + 0.7, platform + 2.5, d - 2.95),
                DARK,
                at=at,
                faces=SOUTH,
                levels=(0.25, ENDLESS),
            )
    row = dice.pick((DISKS, STEPPED_FRET))
    for quarter in (0, 1, 3):
        frame, half, reach = around(at, quarter, (w, d))
        y = platform + tall * 0.78
        frieze(
            s,
            frame,
            -half + 0.2,
            half - 0.2,
            y,
            reach + 0.06,
            tall * 0.2,
            row,
            levels=(0.15, ENDLESS),
        )
    s.box(
        (-w - 0.25, platform + tall - 0.04, -d - 0.25),
        (w + 0.25, platform + tall + 0.4, d + 0.25),
        LIME.tinted(*dice.pick(BANDS)),
        at=at,
        faces=CLOSED,
        top=ROOF,
    )
    crest(s, at, w, d, platform + tall + 0.36, 0.7, dice.whole(0, 1))


def quarter_shrine(s: Sketch, layout: Layout, area: Rect, dice: Dice) -> None:
    """A small square with a pyramid, a hall and a school."""
    layout.paint(area, Ground.MARKET)
    x, z = (area.x0 + area.x1) / 2, (area.z0 + area.z1) / 2
    y = HEIGHTS[Ground.MARKET]
    half = dice.between(8.5, 11.0)
    quarter = dice.whole(0, 3)
    wall = dice.pick((STONE, RED_STONE, STONE.tinted(*rgb("e6c690"))))
    p = Pyramid(half, half, half * dice.between(0.66, 0.88), dice.whole(2, 4), half * 0.4, 1, wall)
    back = Place(x, 0.0, z, quarter).point(0.0, 0.0, -6.0)
    pyramid(s, Place(back[0], y, back[2], quarter), p, dice)
    layout.cover(Rect(back[0] - half, back[2] - half, back[0] + half, back[2] + half))
    for side in (-1, 1):
        spot = Place(x, y, z, quarter).point(side * 17.0, 0.0, 3.0)
        turn = (quarter + (1 if side < 0 else 3)) % 4
        hall(s, Place(spot[0], y, spot[2], turn), 9.0, 3.4, 4.2, dice)
    for side in (-1, 1):
        spot = Place(x, y, z, quarter).point(side * 6.0, 0.0, 17.0)
        banner(s, Place(spot[0], y, spot[2], quarter), 7.0, dice)


def palace(s: Sketch, layout: Layout, area: Rect, dice: Dice) -> None:
    """Halls around courts, two storeys, on a platform."""
    y = HEIGHTS[Ground.STREET]
    base = area.inset(1.5)
    layout.paint(area, Ground.AVENUE)
    s.box((base.x0, y - 0.4, base.z0), (base.x1, y + 1.0, base.z1), STONE, top=PAVING, taper=0.15)
    s.solids.append((*base, y + 1.0))
    layout.cover(base)
    nx = max(1, round(base.width / 46))
    nz = max(1, round(base.depth / 46))
    cw, cd = base.width / nx, base.depth / nz
    for i in range(nx):
        for j in range(nz):
            cx, cz = base.x0 + (i + 0.5) * cw, base.z0 + (j + 0.5) * cd
            hw, hd = cw / 2 - 1.2, cd / 2 - 1.2
            deep = 5.0
            for quarter in range(4):
                along = (hw if quarter % 2 == 0 else hd) - (
                    0.3 if quarter % 2 == 0 else 2 * deep + 0.6
                )
                reach = (hd if quarter % 2 == 0 else hw) - deep
                frame = Place(cx, y + 1.0, cz, quarter)
                inward = frame.point(0.0, 0.0, reach)
                # halls open to the court
                spot = Place(
                    inward[0], y + 1.0 + 0.04 * (quarter % 2), inward[2], (quarter + 2) % 4
                )
                tall = dice.between(5.0, 6.0) + (2.5 if quarter == 0 else 0.0)
                hall(s, spot, along, deep - 0.4, tall, dice)
                _outer_face(s, spot, along, deep - 0.4, tall, dice)
    for k in range(4):
        at = Place(base.x0 + (k + 0.5) * base.width / 4, y + 1.0, base.z1 - 0.9, 0)
        s.box((-0.3, 0, -0.3), (0.3, 1.2, 0.3), STONE, at=at, levels=(0.6, ENDLESS))


def _outer_face(s: Sketch, spot: Place, w: float, d: float, tall: float, dice: Dice) -> None:
    """Windows, doors and bands on the back of a hall, which looks to the street."""
    at = Place(spot.x, spot.y + 1.4, spot.z, (spot.quarter + 2) % 4)
    frieze(
        s, at, -w + 0.3, w - 0.3, tall * 0.74, d + 0.06, tall * 0.2, DISKS, levels=(0.2, ENDLESS)
    )
    s.box(
        (-w + 0.02, -0.1, d - 0.1),
        (w - 0.02, 1.0, d + 0.08),
        RED.shaded(0.9),
        at=at,
        faces=STANDING & ~NORTH,
        levels=(0.3, ENDLESS),
    )
    count = max(2, int(2 * w / 3.6))
    for k in range(count):
        x = -w + (k + 0.5) * 2 * w / count
        s.box(
            (x - 0.5, 1.5, d - 0.2),
            (x + 0.5, 2.9, d + 0.05),
            DARK,
            at=at,
            faces=SOUTH,
            levels=(0.3, ENDLESS),
        )
        s.box(
            (x - 0.8, 2.9, d - 0.1),
            (x + 0.8, 3.2, d + 0.18),
            OLD_WOOD,
            at=at,
            faces=CLOSED & ~NORTH,
            levels=(dice.between(0.5, 0.8), ENDLESS),
        )
        for side in (-1, 1):
            a, b = sorted((x + side * 0.5, x + side * 0.72))
            s.box(
                (a, 1.4, d - 0.1),
                (b, 2.9, d + 0.13),
                TURQUOISE,
                at=at,
                faces=STANDING & ~NORTH,
                levels=(dice.between(0.7, 1.1), ENDLESS),
            )
