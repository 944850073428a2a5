"""Temple houses and what adorns them: painted bands, crests, braziers, banners.

Local frame: the front is +z; y = 0 is the ground.
"""

from __future__ import annotations

from farfield_worker.demo.friezes import BANDS
from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.looks import (
    DARK,
    LIME,
    OLD_WOOD,
    STONE,
    WOOD,
    Look,
    Material,
    rgb,
)
from farfield_worker.demo.sketch import (
    ALWAYS,
    CLOSED,
    SOUTH,
    Levels,
    Place,
    Sketch,
)
from farfield_worker.demo.surfaces import ENDLESS

PAINT = Look(Material.PAINT, rgb("ffffff"), grain=0.3)


def frieze(
    s: Sketch,
    at: Place,
    x0: float,
    x1: float,
    y: float,
    z: float,
    tall: float,
    row: int,
    levels: Levels = ALWAYS,
) -> None:
    """A painted band on a wall that looks to local +z."""
    top, bottom = BANDS[row]
    repeats = round((x1 - x0) / tall) / 4
    s.quad(
        ((x0, y, z), (x1, y, z), (x1, y + tall, z), (x0, y + tall, z)),
        PAINT,
        at=at,
        uv=(0.0, max(repeats, 0.25), bottom, top),
        levels=levels,
    )


def around(at: Place, quarter: int, half: tuple[float, float]) -> tuple[Place, float, float]:
    """Frame of one side of a body at `at`: same origin, turned; its half length and distance."""
    turned = Place(at.x, at.y, at.z, (at.quarter + quarter) % 4)
    hx, hz = half
    return (turned, hx, hz) if quarter % 2 == 0 else (turned, hz, hx)


def brazier(s: Sketch, at: Place, x: float, z: float, r: float) -> None:
    """A stone bowl with a fire."""
    s.lathe(
        (x, -0.05, z),
        r,
        r * 2.2,
        4,
        STONE.shaded(0.85)._replace(rough=0.0),
        at=at,
        sides=8,
        rings=4,
        levels=(0.2, ENDLESS),
        lid=(0.98, 0.98, DARK),
    )
    s.lathe(
        (x, r * 1.9, z),
        r * 0.7,
        r * 2.4,
        6,
        Look(Material.PLASTER, rgb("ff9a2e")),
        at=at,
        sides=6,
        rings=3,
        levels=(0.25, ENDLESS),
    )


def shrine(
    s: Sketch,
    at: Place,
    x: float,
    z: float,
    w: float,
    d: float,
    tall: float,
    paint: Look,
    row: int,
    style: int,
) -> None:
    """A temple house with a doorway to +z, a tall painted roof and a crest of merlons."""
    here = Place(*at.point(x, 0.0, z), at.quarter)
    body = tall * 0.5
    s.box((-w, -0.2, -d), (w, body, d), LIME, at=here, solid=True)
    door = w * 0.42
    s.box((-door, 0.0, d - 0.5), (door, body * 0.8, d + 0.05), DARK, at=here, faces=SOUTH)
    s.box(
        (-door - 0.5, body * 0.8, d - 0.2),
        (door + 0.5, body * 0.8 + 0.45, d + 0.3),
        WOOD,
        at=here,
        faces=CLOSED,
        levels=(0.35, ENDLESS),
    )
    for side in (-1, 1):
        a, b = sorted((side * door, side * (door + 0.45)))
        s.box((a, 0.0, d - 0.2), (b, body * 0.8, d + 0.22), paint, at=here, levels=(0.35, ENDLESS))
    dado = body * 0.22
    s.box(
        (-w - 0.06, -0.2, -d - 0.06),
        (w + 0.06, dado, d - 0.4),
        paint,
        at=here,
        levels=(0.3, ENDLESS),
    )
    for side in (-1, 1):
        a, b = sorted((side * (door + 0.45), side * (w + 0.06)))
        s.box((a, -0.2, d - 0.4), (b, dado, d + 0.06), paint, at=here, levels=(0.3, ENDLESS))
    roof = tall * 0.5
    lean = min(w, d) * 0.24
    s.box(
        (-w - 0.35, body - 0.05, -d - 0.35),
        (w + 0.35, body + 0.5, d + 0.35),
        LIME,
        at=here,
        faces=CLOSED,
    )
    s.box((-w, body + 0.4, -d), (w, body + roof, d), paint, at=here, taper=lean)
    band = min(1.6, roof * 0.3)
    y0, y1 = body + 0.56, body + 0.56 + band
    in0, in1 = (lean * (y - body - 0.4) / (roof - 0.4) - 0.07 for y in (y0, y1))
    for quarter in range(4):
        frame, half, reach = around(here, quarter, (w, d))
        v1, v0 = BANDS[row]
        repeats = max(1, round(2 * half / band)) / 4
        s.quad(
            (
                (-half + in0, y0, reach - in0),
                (half - in0, y0, reach - in0),
                (half - in1, y1, reach - in1),
                (-half + in1, y1, reach - in1),
            ),
            PAINT,
            at=frame,
            uv=(0.0, repeats, v0, v1),
            levels=(0.2, ENDLESS),
        )
    top = body + roof
    s.box(
        (-w + lean - 0.2, top - 0.1, -d + lean - 0.2),
        (w - lean + 0.2, top + 0.45, d - lean + 0.2),
        LIME,
        at=here,
        faces=CLOSED,
    )
    crest(s, here, w - lean, d - lean, top + 0.44, 0.9 if tall > 9 else 0.6, style)


def crest(s: Sketch, at: Place, hx: float, hz: float, y: float, tall: float, style: int) -> None:
    """Merlons around the top of a roof."""
    for quarter in range(4):
        frame, half, reach = around(at, quarter, (hx, hz))
        count = max(3, int(2 * half / (tall * 1.15)))
        for k in range(count):
            x = (k + 0.5) / count * 2 * half - half
            if abs(x) > half - 0.35 and quarter % 2:
                continue
            e = half / count * 0.62
            s.box(
                (x - e, y - 0.05, reach - 0.3),
                (x + e, y + tall, reach),
                LIME.shaded(0.97),
                at=frame,
                taper=(e * (0.5 if style != 1 else 0.0), 0.0),
                levels=(0.3, ENDLESS),
            )
            if style == 1:
                s.box(
                    (x - e * 0.5, y + tall - 0.02, reach - 0.3),
                    (x + e * 0.5, y + tall * 1.4, reach),
                    LIME,
                    at=frame,
                    levels=(0.6, ENDLESS),
                )


def banner(s: Sketch, at: Place, tall: float, dice: Dice) -> None:
    """A pole with a long flag of cloth and feathers."""
    s.box((-0.5, -0.1, -0.5), (0.5, 0.5, 0.5), STONE, at=at, levels=(0.4, ENDLESS))
    s.box((-0.09, 0, -0.09), (0.09, tall, 0.09), OLD_WOOD, at=at, levels=(0.15, ENDLESS))
    s.box(
        (-0.05, tall - 0.2, -0.06),
        (1.5, tall - 0.08, 0.06),
        OLD_WOOD,
        at=at,
        faces=CLOSED,
        levels=(0.6, ENDLESS),
    )
    cloth = Look(
        Material.CLOTH, dice.pick((rgb("c8382c"), rgb("2f8f94"), rgb("e0a030"))), grain=0.8
    )
    drop = tall * 0.5
    s.quad(
        (
            (0.12, tall - drop, 0.0),
            (1.4, tall - drop, 0.1),
            (1.4, tall - 0.14, 0.0),
            (0.12, tall - 0.14, 0.0),
        ),
        cloth,
        at=at,
        uv=(0, 1, 2.0, 0),
        sag=(0.0, 0.0, 0.35),
        levels=(0.15, ENDLESS),
    )
