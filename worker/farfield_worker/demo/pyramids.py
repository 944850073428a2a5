"""Stepped pyramids: tiers of slope and panel, stairs between balustrades, shrines on top.

Local frame: the stairs are on the +z side; y = 0 is the ground the pyramid stands on.
"""

from __future__ import annotations

from dataclasses import dataclass

from farfield_worker.demo.friezes import DISKS, SKULLS, STEPPED_FRET, STRIPES
from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.looks import (
    BLUE,
    LIME,
    OCHRE,
    PAVING,
    RED,
    STONE,
    TURQUOISE,
    Look,
)
from farfield_worker.demo.shrines import around, brazier, frieze, shrine
from farfield_worker.demo.sketch import (
    CLOSED,
    NORTH,
    Place,
    Sketch,
)
from farfield_worker.demo.surfaces import ENDLESS


@dataclass(frozen=True)
class Pyramid:
    """Measures of a pyramid, metres; half extents at the foot."""

    half_width: float
    half_depth: float
    height: float
    tiers: int
    stair_half: float
    shrines: int
    wall: Look
    stairs: int = 1


def pyramid(s: Sketch, at: Place, p: Pyramid, dice: Dice) -> None:
    """Build one pyramid with everything on it."""
    rise = p.height / p.tiers
    setback, lean = rise * 0.34, rise * 0.16
    hx, hz = p.half_width, p.half_depth
    for k in range(p.tiers):
        y = k * rise
        wall = p.wall.shaded(1.0 - 0.04 * (k % 2))
        s.box(
            (-hx, y - 0.3, -hz), (hx, y + rise, hz), wall, at=at, taper=lean, top=PAVING, solid=True
        )
        _panel(s, at, hx - lean * 0.55, hz - lean * 0.55, y + rise, rise, p, k)
        _bosses(s, at, hx, hz, y, rise, lean, wall, dice)
        hx, hz = hx - lean - setback, hz - lean - setback
    top_x, top_z = hx + setback, hz + setback
    _stairs(s, at, p, top_z + 0.45 * lean + 0.75)
    _crown(s, at, p, top_x, top_z, dice)


def _panel(
    s: Sketch, at: Place, hx: float, hz: float, y: float, rise: float, p: Pyramid, k: int
) -> None:
    """The upright panel over the slope of a tier (talud and tablero), framed and painted."""
    tall = rise * 0.45
    edge = min(0.3, tall * 0.16)
    foot = y - tall
    s.box(
        (-hx - 0.1, foot, -hz - 0.1),
        (hx + 0.1, y + 0.1, hz + 0.1),
        LIME.shaded(0.94),
        at=at,
        top=PAVING,
        faces=CLOSED,
    )
    level = 0.12 + 0.02 * k
    for low, high in ((foot - 0.05, foot + edge), (y + 0.1 - edge, y + 0.16)):
        s.box(
            (-hx - 0.3, low, -hz - 0.3),
            (hx + 0.3, high, hz + 0.3),
            LIME,
            at=at,
            top=PAVING,
            faces=CLOSED,
            levels=(level, ENDLESS),
        )
    row = (STEPPED_FRET, DISKS)[k % 2]
    for quarter in range(4):
        frame, half, reach = around(at, quarter, (hx, hz))
        gap = p.stair_half + 0.8 if quarter == 0 else 0.0
        spans = [(-half + 0.2, -gap), (gap, half - 0.2)] if gap else [(-half + 0.2, half - 0.2)]
        for a, b in spans:
            if b - a > 1.5:
                frieze(
                    s,
                    frame,
                    a,
                    b,
                    foot + edge,
                    reach + 0.16,
                    tall - 2 * edge + 0.1,
                    row,
                    levels=(level, ENDLESS),
                )


def _bosses(
    s: Sketch,
    at: Place,
    hx: float,
    hz: float,
    y: float,
    rise: float,
    lean: float,
    wall: Look,
    dice: Dice,
) -> None:
    """Stones that stand out of the sloping walls."""
    for quarter in range(4):
        frame, half, reach = around(at, quarter, (hx, hz))
        count = int(half * 2 / 1.5)
        for row in range(max(1, int(rise / 2.2))):
            for k in range(count):
                level = dice.between(0.7, 2.6)
                t = (row + dice.between(0.2, 0.7)) * 2.2 / rise
                if t > 0.5:
                    continue
                x = (k + dice.between(0.25, 0.75)) / count * 2 * half - half
                if abs(x) > half - lean - 0.6:
                    continue
                z = reach - lean * t
                a, b = dice.between(0.2, 0.45), dice.between(0.14, 0.24)
                s.box(
                    (x - a, y + t * rise - b, z - 0.3),
                    (x + a, y + t * rise + b, z + 0.09),
                    wall.shaded(dice.between(0.82, 1.12))._replace(grain=0.0),
                    at=frame,
                    faces=CLOSED & ~NORTH,
                    levels=(level, ENDLESS),
                )


def _stairs(s: Sketch, at: Place, p: Pyramid, back: float) -> None:
    """Flights from the foot to the platform, with balustrades; coarser ones at low levels."""
    run = p.height * 0.5
    flight = p.stair_half * 2 / p.stairs
    rail = 1.1 if p.height > 15 else 0.6
    for k in range(p.stairs):
        x0 = -p.stair_half + k * flight + rail * 0.5
        x1 = x0 + flight - rail
        full = max(8, round(p.height / 0.3))
        counts = (max(4, full // 6), max(6, full // 3), full)
        limits = (0.0, 0.22, 0.45, ENDLESS)
        for n, low, high in zip(counts, limits[:-1], limits[1:], strict=True):
            for i in range(n):
                y0, y1 = p.height * i / n, p.height * (i + 1) / n
                z1, z2 = back + run * (1 - i / n), back + run * (1 - (i + 1) / n)
                z2 -= 2.0 if i == n - 1 else 0.0
                y1 += 0.2 if i == n - 1 else 0.0
                tone = STONE.shaded(1.02 if i % 2 else 0.95)._replace(rough=0.0)
                s.quad(
                    ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
                    tone,
                    at=at,
                    levels=(low, high),
                )
                s.quad(
                    ((x0, y1, z1), (x1, y1, z1), (x1, y1, z2), (x0, y1, z2)),
                    PAVING,
                    at=at,
                    levels=(low, high),
                )
    for k in range(p.stairs + 1):
        x = -p.stair_half + k * flight
        _balustrade(s, at, x - rail * 0.5, x + rail * 0.5, back, run, p.height)


def _balustrade(
    s: Sketch, at: Place, a: float, b: float, back: float, run: float, height: float
) -> None:
    """A sloping wall beside a flight, an upright block at its top, a serpent's head at its foot."""
    up = 0.85
    z0, z1 = back + run + 0.5, back + run * 0.12 + 0.5
    y1 = height * 0.88 + up
    look = LIME.shaded(0.95)
    foot = -0.3
    s.quad(((a, up, z0), (b, up, z0), (b, y1, z1), (a, y1, z1)), look, at=at)
    s.quad(((b, foot, z0), (b, foot, z1), (b, y1, z1), (b, up, z0)), look, at=at)
    s.quad(((a, foot, z1), (a, foot, z0), (a, up, z0), (a, y1, z1)), look, at=at)
    s.quad(((a, foot, z0), (b, foot, z0), (b, up, z0), (a, up, z0)), look, at=at)
    s.box((a - 0.06, height * 0.7, back - 2.0), (b + 0.06, height + 0.9, z1 + 0.1), look, at=at)
    if height < 8:
        return
    w = (b - a) / 2
    x = (a + b) / 2
    # the head: jaw, muzzle, brow, two eyes
    stone = TURQUOISE.shaded(0.8)
    s.box(
        (x - w * 1.25, -0.2, z0 - 0.3),
        (x + w * 1.25, 0.75, z0 + 2.0),
        stone,
        at=at,
        taper=(0.1, 0.15),
        levels=(0.3, ENDLESS),
    )
    s.box(
        (x - w * 1.1, 0.6, z0 - 0.3),
        (x + w * 1.1, 1.35, z0 + 1.6),
        stone.shaded(1.15),
        at=at,
        taper=(0.15, 0.25),
        levels=(0.3, ENDLESS),
    )
    for side in (-1, 1):
        s.box(
            (x + side * w * 1.12 - 0.14, 0.75, z0 + 0.5),
            (x + side * w * 1.12 + 0.14, 1.1, z0 + 0.9),
            LIME,
            at=at,
            levels=(0.7, ENDLESS),
        )
        s.box(
            (x + side * w * 0.6 - 0.1, 0.3, z0 + 1.9),
            (x + side * w * 0.6 + 0.1, 0.75, z0 + 2.12),
            LIME,
            at=at,
            levels=(0.8, ENDLESS),
        )


def _crown(s: Sketch, at: Place, p: Pyramid, hx: float, hz: float, dice: Dice) -> None:
    """Shrines, braziers and a stone on the platform."""
    top = Place(at.x, at.y + p.height, at.z, at.quarter)
    colors = (
        ((RED, SKULLS, 0), (BLUE, STRIPES, 1))
        if p.shrines == 2
        else ((dice.pick((RED, OCHRE, TURQUOISE, BLUE)), dice.pick((SKULLS, DISKS, STRIPES)), 2),)
    )
    room = 2 * hx / len(colors)
    for k, (paint, row, style) in enumerate(colors):
        x = -hx + (k + 0.5) * room
        w = room * 0.40
        d = hz * 0.52
        shrine(
            s,
            top,
            x,
            -hz + d + 0.7,
            w,
            d,
            p.height * (0.38 if p.height > 20 else 0.55),
            paint,
            row,
            style,
        )
        stone = Place(top.x, top.y, top.z, top.quarter)
        s.box(
            (x - 0.4, -0.1, hz * 0.35),
            (x + 0.4, 0.8, hz * 0.35 + 0.6),
            STONE,
            at=stone,
            levels=(0.5, ENDLESS),
        )
    for x in (-hx + 0.8, hx - 0.8):
        if hx - 0.8 > p.stair_half + 1.0:
            brazier(s, top, x, hz - 0.8, 0.55 if p.height > 15 else 0.35)
