"""The sacred precinct."""

from __future__ import annotations

from farfield_worker.demo.friezes import SKULLS, STEPPED_FRET
from farfield_worker.demo.halls import hall, palace, quarter_shrine
from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.layout import HEIGHTS, PRECINCT, Ground, Layout, Rect
from farfield_worker.demo.looks import (
    DARK,
    LIME,
    OLD_WOOD,
    PAVING,
    RED,
    RED_STONE,
    STONE,
    THATCH,
    TURQUOISE,
    Look,
    Material,
    rgb,
)
from farfield_worker.demo.pyramids import Pyramid, pyramid
from farfield_worker.demo.shrines import banner, brazier, crest, frieze
from farfield_worker.demo.sketch import (
    CLOSED,
    NORTH,
    SOUTH,
    STANDING,
    Place,
    Sketch,
)
from farfield_worker.demo.surfaces import ENDLESS

PLAZA = HEIGHTS[Ground.PLAZA]


def temples(s: Sketch, layout: Layout) -> None:
    """Build all of them."""
    _precinct(s, layout)
    for k, area in enumerate(layout.shrines):
        quarter_shrine(s, layout, area, Dice(91, k))
    for k, name in enumerate(("palace", "old palace")):
        palace(s, layout, layout.places[name], Dice(92, k))


def _stand(layout: Layout, x: float, z: float, hx: float, hz: float) -> None:
    layout.cover(Rect(x - hx, z - hz, x + hx, z + hz))


def _precinct(s: Sketch, layout: Layout) -> None:
    dice = Dice(90)
    great = Pyramid(40.0, 34.0, 30.0, 5, 15.0, 2, STONE.tinted(*rgb("f6e6c8")), stairs=2)
    s.box((-50, PLAZA - 0.5, -96), (50, PLAZA + 2.6, -8), STONE, top=PAVING, taper=0.6, solid=True)
    for k, (y, z) in enumerate(((0.65, -5.2), (1.3, -5.9), (1.95, -6.6), (2.6, -7.3))):
        half = 22 - 0.05 * k
        s.box(
            (-half, PLAZA - 0.3, -8.4),
            (half, PLAZA + y - 0.03, z + 0.7),
            LIME.shaded(0.95 + 0.01 * k),
            top=PAVING,
            faces=STANDING & ~NORTH,
        )
    _stand(layout, 0, -52, 49, 43)
    pyramid(s, Place(0.0, PLAZA + 2.6, -55.0, 0), great, dice)
    for x, z, half, tall, tiers, quarter, wall in (
        (-78, -70, 14.0, 14.0, 4, 1, RED_STONE),
        (78, -70, 14.0, 14.0, 4, 3, STONE),
        (-80, -18, 12.0, 10.0, 3, 1, STONE),
        (80, -18, 12.0, 10.0, 3, 3, RED_STONE),
        (-82, 28, 10.0, 8.0, 3, 1, STONE.tinted(*rgb("f0cc94"))),
        (82, 28, 10.0, 8.0, 3, 3, STONE),
    ):
        p = Pyramid(half, half, tall, tiers, half * 0.42, 1, wall)
        pyramid(s, Place(x, PLAZA, z, quarter), p, Dice(93, x, z))
        _stand(layout, x, z, half - 1, half - 1)
    _round_temple(s, layout, 0.0, 38.0)
    _ball_court(s, -48.0, 66.0)
    _skull_rack(s, 46.0, 70.0)
    for side, z, quarter in ((-80, 62, 1), (80, 64, 3)):
        hall(s, Place(side, PLAZA, z, quarter), 20.0, 9.0, 6.2, Dice(94, side))
    _walls(s, dice)
    for east in (-24.0, -12.0, 12.0, 24.0):
        for south in (12.0, 60.0, 84.0):
            at = Place(0.0, PLAZA, 0.0, 0)
            s.box(
                (east - 0.8, -0.1, south - 0.8),
                (east + 0.8, 0.9, south + 0.8),
                STONE,
                at=at,
                taper=0.1,
            )
            brazier(s, Place(0.0, PLAZA + 0.9, 0.0, 0), east, south, 0.5)
    for east in (-17.5, 17.5):
        for south in (24.0, 50.0, 74.0, 98.0):
            banner(s, Place(east, PLAZA, south, 0), 9.0, dice)


def _walls(s: Sketch, dice: Dice) -> None:
    """The serpent wall with merlons and four gates."""
    at = [Place(0.0, PLAZA, 0.0, q) for q in range(4)]
    reach, gate, tall = PRECINCT - 1.0, 10.0, 3.4
    for quarter, frame in enumerate(at):
        end = reach - 1.6 * (quarter % 2)  # walls that meet in a corner
        for a, b in ((-end, -gate), (gate, end)):
            s.box(
                (a, -1.2, reach - 1.6),
                (b, tall, reach),
                STONE.tinted(*rgb("d9c6a2")),
                at=frame,
                solid=True,
            )
            s.box(
                (a + 0.05, tall - 0.7, reach - 1.7),
                (b - 0.05, tall + 0.25, reach + 0.14),
                LIME,
                at=frame,
                faces=CLOSED,
                levels=(0.25, ENDLESS),
            )
            frieze(
                s,
                frame,
                a + 0.3,
                b - 0.3,
                tall - 0.62,
                reach + 0.2,
                0.75,
                STEPPED_FRET,
                levels=(0.35, ENDLESS),
            )
            count = int((b - a) / 2.2)
            for k in range(count):
                x = a + (k + 0.5) * (b - a) / count
                s.box(
                    (x - 0.55, tall + 0.2, reach - 1.2),
                    (x + 0.55, tall + 1.15, reach - 0.3),
                    LIME.shaded(0.95),
                    at=frame,
                    taper=(0.3, 0.15),
                    levels=(0.3 + 0.3 * dice.between(0, 1), ENDLESS),
                )
            # a serpent's coils along the wall
            for k in range(int((b - a) / 3.0)):
                x = a + (k + 0.5) * 3.0
                s.box(
                    (x - 0.5, 0.9, reach - 0.1),
                    (x + 0.5, 1.7, reach + 0.3),
                    TURQUOISE.shaded(0.85),
                    at=frame,
                    taper=(0.2, 0.1),
                    levels=(dice.between(0.5, 1.2), ENDLESS),
                )
        for rise, run in ((-0.27, 1.6), (-0.53, 2.2)):
            half = gate + 0.05 * run
            s.box(
                (-half, -1.0, reach + 1.0),
                (half, rise, reach + run),
                STONE,
                at=frame,
                top=PAVING,
                faces=STANDING & ~NORTH,
            )
        for x in (-gate - 1.5, gate + 1.5):
            s.box(
                (x - 2.2, -1.2, reach - 2.6),
                (x + 2.2, tall + 2.6, reach + 1.0),
                LIME,
                at=frame,
                taper=0.2,
                solid=True,
            )
            s.box(
                (x - 2.4, tall + 2.55, reach - 2.8),
                (x + 2.4, tall + 3.1, reach + 1.2),
                RED,
                at=frame,
                faces=CLOSED,
            )
            here = Place(*frame.point(x, 0.0, reach - 0.8), frame.quarter)
            crest(s, here, 2.2, 1.8, tall + 3.05, 0.6, 0)
            frieze(s, here, -1.9, 1.9, tall + 0.9, 1.84, 1.0, SKULLS, levels=(0.2, ENDLESS))


def _round_temple(s: Sketch, layout: Layout, x: float, z: float) -> None:
    """The wind god's temple: round tiers and a thatched cone."""
    at = Place(x, PLAZA, z, 0)
    stone = STONE._replace(rough=0.0)
    for k, (r, y0, y1) in enumerate(((11.0, -0.3, 2.6), (9.2, 2.5, 5.2), (7.4, 5.1, 7.8))):
        s.lathe(
            (0, y0, 0),
            r,
            y1 - y0,
            0,
            (stone, RED_STONE._replace(rough=0.0), stone)[k],
            at=at,
            sides=22,
            rings=2,
        )
        s.lathe((0, y1 + 0.04, 0), r + 0.26, 0.1, 1, PAVING, at=at, sides=22, rings=2)
        s.lathe(
            (0, y1 - 0.7, 0),
            r + 0.25,
            0.75,
            0,
            LIME,
            at=at,
            sides=22,
            rings=1,
            levels=(0.25, ENDLESS),
        )
    s.solids.append((x - 9, z - 9, x + 9, z + 9, PLAZA + 6.0))
    s.lathe((0, 7.7, 0), 4.6, 4.0, 0, LIME._replace(rough=0.0), at=at, sides=18, rings=2)
    s.lathe((0, 11.4, 0), 5.8, 6.5, 1, THATCH, at=at, sides=20, rings=5)
    s.lathe((0, 11.38, 0), 5.8, 0.02, 7, THATCH.shaded(0.6), at=at, sides=20, rings=1)
    s.box((-1.1, 7.9, 4.0), (1.1, 10.6, 4.75), DARK, at=at, faces=SOUTH)
    n = 26
    for i in range(n):
        y0, y1 = 7.9 * i / n, 7.9 * (i + 1) / n
        z0 = 14.6 - 8.0 * i / n
        half = 2.6 - 0.01 * i
        s.box(
            (-half, y0 - 0.4, 5.0),
            (half, y1, z0),
            STONE.shaded(1.0 if i % 2 else 0.95),
            at=at,
            top=PAVING,
            faces=STANDING & ~NORTH,
            levels=(0.0 if i % 3 == 2 else 0.35, ENDLESS),
        )


def _ball_court(s: Sketch, x: float, z: float) -> None:
    """Two long sloping benches between end walls."""
    at = Place(x, PLAZA, z, 0)
    for side in (-1, 1):
        a, b = sorted((side * 4.5, side * 12.0))
        s.box((a, -0.3, -19), (b, 3.6, 19), STONE, at=at, top=PAVING, taper=(0.9, 0.3), solid=True)
        a, b = sorted((side * 3.2, side * 5.2))
        s.box((a, -0.3, -18), (b, 1.2, 18), LIME, at=at, taper=(0.5, 0.2))
        here = Place(at.x, at.y, at.z, 0)
        s.box(
            (side * 5.4 - 0.3, 2.6, -0.7),
            (side * 5.4 + 0.3, 4.0, 0.7),
            RED,
            at=here,
            levels=(0.4, ENDLESS),
        )
        for end in (-1, 1):
            c, d = sorted((end * 22.0, end * 23.2))
            e, f = sorted((side * 1.5, side * 12.0))
            s.box((e, -0.3, c), (f, 2.4, d), STONE, at=at)


def _skull_rack(s: Sketch, x: float, z: float) -> None:
    """The tzompantli: poles and crossbars over a carved platform."""
    at = Place(x, PLAZA, z, 0)
    s.box((-14, -0.3, -5), (14, 1.8, 5), STONE, at=at, top=PAVING, taper=0.2, solid=True)
    for quarter, half, reach in (
        (0, 13.6, 5.05),
        (1, 4.8, 14.05),
        (2, 13.6, 5.05),
        (3, 4.8, 14.05),
    ):
        frieze(
            s,
            Place(x, PLAZA, z, quarter),
            -half,
            half,
            0.3,
            reach,
            1.2,
            SKULLS,
            levels=(0.2, ENDLESS),
        )
    bone = Look(Material.PLASTER, rgb("efe4cc"))
    for row in (-2.4, 0.0, 2.4):
        for k in range(9):
            px = -12.0 + k * 3.0
            s.box((px - 0.14, 1.7, row - 0.14), (px + 0.14, 6.4, row + 0.14), OLD_WOOD, at=at)
        for bar in range(5):
            y = 2.5 + bar * 0.85
            s.box(
                (-12.4, y - 0.05, row - 0.05),
                (12.4, y + 0.05, row + 0.05),
                OLD_WOOD,
                at=at,
                faces=CLOSED,
                levels=(0.4, ENDLESS),
            )
            for k in range(24):
                if k % 3 == 0:
                    continue
                px = -12.0 + k * 1.0
                s.box(
                    (px - 0.15, y - 0.16, row - 0.17),
                    (px + 0.15, y + 0.16, row + 0.17),
                    bone,
                    at=at,
                    faces=CLOSED,
                    levels=(0.7 + 0.3 * ((k * 7 + bar) % 5) / 5, ENDLESS),
                )
