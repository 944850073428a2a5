"""Stepped pyramids: tiers with cornices, stairs between balustrades, shrines on top.

Local frame: the stairs are on the +z side; y = 0 is the ground the pyramid stands on.
"""

from __future__ import annotations

from dataclasses import dataclass

from farfield_worker.demo.friezes import BANDS, DISKS, SKULLS, STEPPED_FRET, STRIPES
from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.looks import (
    BLUE,
    DARK,
    LIME,
    OCHRE,
    PAVING,
    RED,
    STONE,
    TURQUOISE,
    WOOD,
    Look,
    Material,
    rgb,
)
from farfield_worker.demo.sketch import (
    ALWAYS,
    CLOSED,
    EAST,
    ENDLESS,
    NORTH,
    SIDES,
    SOUTH,
    STANDING,
    TOP,
    WEST,
    Levels,
    Place,
    Sketch,
)

PAINT = Look(Material.PAINT, rgb("ffffff"), grain=0.3)


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


def frieze(
    s: Sketch, at: Place, x0: float, x1: float, y: float, z: float, tall: float, row: int,
    levels: Levels = ALWAYS,
) -> None:
    """A painted band on a wall that looks to local +z."""
    top, bottom = BANDS[row]
    repeats = round((x1 - x0) / tall) / 4
    s.quad(((x0, y, z), (x1, y, z), (x1, y + tall, z), (x0, y + tall, z)), PAINT, at=at,
           uv=(0.0, max(repeats, 0.25), bottom, top), levels=levels)


def around(at: Place, quarter: int, half: tuple[float, float]) -> tuple[Place, float, float]:
    """Frame of one side of a body at `at`: same origin, turned; its half length and distance."""
    turned = Place(at.x, at.y, at.z, (at.quarter + quarter) % 4)
    hx, hz = half
    return (turned, hx, hz) if quarter % 2 == 0 else (turned, hz, hx)


def pyramid(s: Sketch, at: Place, p: Pyramid, dice: Dice) -> None:
    """Build one pyramid with everything on it."""
    rise = p.height / p.tiers
    setback = rise * 0.34
    lean = rise * 0.16
    hx, hz = p.half_width, p.half_depth
    for k in range(p.tiers):
        y = k * rise
        wall = p.wall.shaded(1.0 - 0.03 * (k % 2))
        s.box((-hx, y - 0.3, -hz), (hx, y + rise, hz), wall, at=at, taper=lean, top=PAVING,
              solid=True)
        _tier_trim(s, at, hx - lean, hz - lean, y + rise, rise, p, k)
        _bosses(s, at, hx, hz, y, rise, lean, wall, dice)
        hx, hz = hx - lean - setback, hz - lean - setback
    top_x, top_z = hx + setback, hz + setback
    _stairs(s, at, p, hz)
    _crown(s, at, p, top_x, top_z, dice)


def _tier_trim(
    s: Sketch, at: Place, hx: float, hz: float, y: float, rise: float, p: Pyramid, k: int
) -> None:
    """Cornice and painted panel along the top of a tier."""
    tall = min(0.9, rise * 0.22)
    s.box((-hx - 0.28, y - tall, -hz - 0.28), (hx + 0.28, y + 0.12, hz + 0.28), LIME, at=at,
          top=PAVING, faces=CLOSED, levels=(0.25 + 0.03 * k, ENDLESS))
    for quarter in range(4):
        frame, half, reach = around(at, quarter, (hx, hz))
        gap = p.stair_half + 1.2 if quarter == 0 else 0.0
        spans = [(-half + 0.5, -gap), (gap, half - 0.5)] if gap else [(-half + 0.5, half - 0.5)]
        for a, b in spans:
            if b - a < 1.5:
                continue
            row = (STEPPED_FRET, DISKS)[k % 2]
            frieze(s, frame, a, b, y - tall + 0.08, reach + 0.34, tall - 0.08, row,
                   levels=(0.35 + 0.05 * k, ENDLESS))


def _bosses(
    s: Sketch, at: Place, hx: float, hz: float, y: float, rise: float, lean: float, wall: Look,
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
                if t > 0.72:
                    continue
                x = (k + dice.between(0.25, 0.75)) / count * 2 * half - half
                if abs(x) > half - lean - 0.6:
                    continue
                z = reach - lean * t
                a, b = dice.between(0.2, 0.45), dice.between(0.14, 0.24)
                s.box((x - a, y + t * rise - b, z - 0.3), (x + a, y + t * rise + b, z + 0.09),
                      wall.shaded(dice.between(0.82, 1.12))._replace(grain=0.0), at=frame,
                      faces=CLOSED & ~NORTH, levels=(level, ENDLESS))


def _stairs(s: Sketch, at: Place, p: Pyramid, top_z: float) -> None:
    """Flights from the foot to the platform, with balustrades; coarser ones at low levels."""
    front = p.half_depth + p.height * 0.16
    back = top_z + 0.2
    flight = p.stair_half * 2 / p.stairs
    rail = 1.1 if p.height > 15 else 0.6
    for k in range(p.stairs):
        x0 = -p.stair_half + k * flight + rail * 0.5
        x1 = x0 + flight - rail
        full = max(8, round(p.height / 0.3))
        counts = (max(4, full // 6), max(6, full // 3), full)
        limits = (0.0, 0.3, 0.7, ENDLESS)
        for n, low, high in zip(counts, limits[:-1], limits[1:], strict=True):
            for i in range(n):
                y0, y1 = p.height * i / n, p.height * (i + 1) / n
                z1 = front + (back - front) * i / n
                z2 = front + (back - front) * (i + 1) / n
                tone = STONE.shaded(1.02 if i % 2 else 0.96)._replace(rough=0.0)
                s.quad(((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)), tone, at=at,
                       levels=(low, high))
                s.quad(((x0, y1, z1), (x1, y1, z1), (x1, y1, z2), (x0, y1, z2)), PAVING, at=at,
                       levels=(low, high))
    for k in range(p.stairs + 1):
        x = -p.stair_half + k * flight
        a, b = x - rail * 0.5, x + rail * 0.5
        _balustrade(s, at, a, b, front, back, p.height)


def _balustrade(
    s: Sketch, at: Place, a: float, b: float, front: float, back: float, height: float
) -> None:
    """A sloping wall beside a flight, with an upright block at its top and a serpent's head below."""
    up = 0.9
    z0, z1 = front + 0.6, back + height * 0.06
    y0, y1 = up, height * 0.9
    look = LIME.shaded(0.95)
    foot = -0.3
    s.quad(((a, y0, z0), (b, y0, z0), (b, y1, z1), (a, y1, z1)), look, at=at)
    s.quad(((b, foot, z0), (b, foot, z1), (b, y1, z1), (b, y0, z0)), look, at=at)
    s.quad(((a, foot, z1), (a, foot, z0), (a, y0, z0), (a, y1, z1)), look, at=at)
    s.quad(((a, foot, z0), (b, foot, z0), (b, y0, z0), (a, y0, z0)), look, at=at)
    s.box((a - 0.05, height * 0.8, back - 0.2), (b + 0.05, height + 0.5, z1 + 0.1), look, at=at)
    if height < 8:
        return
    w = (b - a) / 2
    x = (a + b) / 2
    # the head: jaw, muzzle, brow, two eyes
    stone = TURQUOISE.shaded(0.8)
    s.box((x - w * 1.25, -0.2, z0 - 0.3), (x + w * 1.25, 0.75, z0 + 2.0), stone, at=at,
          taper=(0.1, 0.15), levels=(0.3, ENDLESS))
    s.box((x - w * 1.1, 0.6, z0 - 0.3), (x + w * 1.1, 1.35, z0 + 1.6), stone.shaded(1.15), at=at,
          taper=(0.15, 0.25), levels=(0.3, ENDLESS))
    for side in (-1, 1):
        s.box((x + side * w * 1.12 - 0.14, 0.75, z0 + 0.5), (x + side * w * 1.12 + 0.14, 1.1, z0 + 0.9),
              LIME, at=at, levels=(0.7, ENDLESS))
        s.box((x + side * w * 0.6 - 0.1, 0.3, z0 + 1.9), (x + side * w * 0.6 + 0.1, 0.75, z0 + 2.12),
              LIME, at=at, levels=(0.8, ENDLESS))


def _crown(s: Sketch, at: Place, p: Pyramid, hx: float, hz: float, dice: Dice) -> None:
    """Shrines, braziers and a stone on the platform."""
    top = Place(at.x, at.y + p.height, at.z, at.quarter)
    colors = ((RED, SKULLS, 0), (BLUE, STRIPES, 1)) if p.shrines == 2 else (
        (dice.pick((RED, OCHRE, TURQUOISE, BLUE)), dice.pick((SKULLS, DISKS, STRIPES)), 2),
    )
    room = 2 * hx / len(colors)
    for k, (paint, row, style) in enumerate(colors):
        x = -hx + (k + 0.5) * room
        w = room * 0.40
        d = hz * 0.52
        shrine(s, top, x, -hz + d + 0.7, w, d, p.height * (0.34 if p.height > 20 else 0.5), paint,
               row, style)
        stone = Place(top.x, top.y, top.z, top.quarter)
        s.box((x - 0.4, -0.1, hz * 0.35), (x + 0.4, 0.8, hz * 0.35 + 0.6), STONE, at=stone,
              levels=(0.5, ENDLESS))
    for x in (-hx + 1.0, hx - 1.0):
        brazier(s, top, x, hz - 1.0, 0.55 if p.height > 15 else 0.35)


def brazier(s: Sketch, at: Place, x: float, z: float, r: float) -> None:
    """A stone bowl with a fire."""
    s.lathe((x, -0.05, z), r, r * 2.2, 4, STONE.shaded(0.85)._replace(rough=0.0), at=at, sides=8,
            rings=4, levels=(0.4, ENDLESS))
    s.lathe((x, r * 1.9, z), r * 0.7, r * 2.4, 6, Look(Material.PLASTER, rgb("ff9a2e")), at=at,
            sides=6, rings=3, levels=(0.55, ENDLESS))


def shrine(
    s: Sketch, at: Place, x: float, z: float, w: float, d: float, tall: float, paint: Look,
    row: int, style: int,
) -> None:
    """A temple house with a doorway to +z, a tall painted roof and a crest of merlons."""
    here = Place(*at.point(x, 0.0, z), at.quarter)
    body = tall * 0.5
    s.box((-w, -0.2, -d), (w, body, d), LIME, at=here, solid=True)
    door = w * 0.42
    s.box((-door, 0.0, d - 0.5), (door, body * 0.8, d + 0.05), DARK, at=here, faces=SOUTH)
    s.box((-door - 0.5, body * 0.8, d - 0.2), (door + 0.5, body * 0.8 + 0.45, d + 0.3), WOOD,
          at=here, faces=CLOSED, levels=(0.35, ENDLESS))
    for side in (-1, 1):
        a, b = sorted((side * door, side * (door + 0.45)))
        s.box((a, 0.0, d - 0.2), (b, body * 0.8, d + 0.22), paint, at=here, levels=(0.35, ENDLESS))
    s.box((-w - 0.06, -0.2, -d - 0.06), (-door - 0.5, body * 0.22, d + 0.06), paint, at=here,
          faces=STANDING, levels=(0.4, ENDLESS))
    s.box((door + 0.5, -0.2, -d - 0.06), (w + 0.06, body * 0.22, d + 0.06), paint, at=here,
          faces=STANDING, levels=(0.4, ENDLESS))
    roof = tall * 0.5
    lean = min(w, d) * 0.24
    s.box((-w - 0.35, body - 0.05, -d - 0.35), (w + 0.35, body + 0.5, d + 0.35), LIME, at=here,
          faces=CLOSED)
    s.box((-w, body + 0.4, -d), (w, body + roof, d), paint, at=here, taper=lean)
    t = 0.5
    for quarter in range(4):
        frame, half, reach = around(here, quarter, (w, d))
        z1 = reach - lean * (0.16 / 1) + 0.12
        band = min(1.6, roof * 0.3)
        frieze(s, frame, -half + lean * 0.4, half - lean * 0.4, body + 0.62, z1 + 0.02, band, row,
               levels=(0.2, ENDLESS))
    top = body + roof
    s.box((-w + lean - 0.2, top - 0.1, -d + lean - 0.2), (w - lean + 0.2, top + 0.45, d - lean + 0.2),
          LIME, at=here, faces=CLOSED)
    crest(s, here, w - lean, d - lean, top + 0.44, 0.9 if tall > 9 else 0.6, style)
    del t


def crest(
    s: Sketch, at: Place, hx: float, hz: float, y: float, tall: float, style: int
) -> None:
    """Merlons around the top of a roof."""
    for quarter in range(4):
        frame, half, reach = around(at, quarter, (hx, hz))
        count = max(3, int(2 * half / (tall * 1.15)))
        for k in range(count):
            x = (k + 0.5) / count * 2 * half - half
            if abs(x) > half - 0.35 and quarter % 2:
                continue
            e = half / count * 0.62
            s.box((x - e, y - 0.05, reach - 0.3), (x + e, y + tall, reach), LIME.shaded(0.97),
                  at=frame, taper=(e * (0.5 if style != 1 else 0.0), 0.0), levels=(0.3, ENDLESS))
            if style == 1:
                s.box((x - e * 0.5, y + tall - 0.02, reach - 0.3), (x + e * 0.5, y + tall * 1.4, reach),
                      LIME, at=frame, levels=(0.6, ENDLESS))


__all__ = ["Pyramid", "around", "brazier", "crest", "frieze", "pyramid", "shrine"]
_ = (SIDES, EAST, WEST, TOP)
