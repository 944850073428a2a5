"""Bridges, canoes, jetties, market stalls, torches: the small things of daily life."""

from __future__ import annotations

import numpy as np

from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.layout import (
    CAUSEWAY,
    CAUSEWAY_END,
    GAPS,
    HEIGHTS,
    PITCH,
    Bridge,
    Ground,
    Layout,
    Rect,
)
from farfield_worker.demo.looks import (
    CLAY,
    CLOTHS,
    DARK,
    LIME,
    OLD_WOOD,
    STONE,
    WOOD,
    Look,
    Material,
    rgb,
)
from farfield_worker.demo.shrines import banner
from farfield_worker.demo.sketch import (
    BOTTOM,
    CLOSED,
    EAST,
    NORTH,
    SIDES,
    SOUTH,
    TOP,
    WEST,
    Place,
    Sketch,
)
from farfield_worker.demo.surfaces import ENDLESS

HULL = Look(Material.WOOD, rgb("c09a6c"), grain=0.0)


def waterside(s: Sketch, layout: Layout) -> None:
    """Build all of them."""
    for k, bridge in enumerate(layout.bridges):
        _bridge(s, bridge, Dice(101, k))
    _canoes(s, layout)
    _market(s, layout.places["market"])
    _torches(s, layout)
    _kerbs(s, layout)


def _bridge(s: Sketch, bridge: Bridge, dice: Dice) -> None:
    """A deck of planks that overlaps its ends, with beams and rails."""
    x0, z0, x1, z1 = bridge.area
    along = bridge.along_x
    mx, mz = (x0 + x1) / 2, (z0 + z1) / 2
    half = ((x1 - x0) if along else (z1 - z0)) / 2
    wide = ((z1 - z0) if along else (x1 - x0)) / 2 - 0.06
    at = Place(mx, bridge.height, mz, 1 if along else 0)  # local z runs along the deck
    tone = WOOD.shaded(dice.between(0.8, 1.1))
    top = 0.16
    s.box(
        (-wide, -0.22, -half - 0.5), (wide, top, half + 0.5), tone, at=at, faces=EAST | WEST | TOP
    )
    s.box(
        (-wide, -0.22, -half - 0.5),
        (wide, top, half + 0.5),
        tone,
        at=at,
        faces=NORTH | SOUTH | BOTTOM,
        levels=(0.12, ENDLESS),
    )
    s.solids.append((x0, z0, x1, z1, bridge.height - 0.3))
    for side in (-1, 1):
        a, b = sorted((side * wide, side * (wide - 0.35)))
        s.box(
            (a, -0.75, -half - 0.3),
            (b, -0.2, half + 0.3),
            tone.shaded(0.7),
            at=at,
            faces=CLOSED,
            levels=(0.35, ENDLESS),
        )
        if wide < 1.2 and dice.chance(0.5):
            continue
        posts = max(3, round(half * 2 / 1.8))
        for k in range(posts):
            z = -half - 0.3 + k * (2 * half + 0.6) / (posts - 1)
            c, d = sorted((side * (wide - 0.04), side * (wide - 0.18)))
            s.box(
                (c, top - 0.05, z - 0.07),
                (d, top + 0.95, z + 0.07),
                OLD_WOOD,
                at=at,
                faces=SIDES,
                levels=(0.14, ENDLESS),
            )
        c, d = sorted((side * (wide - 0.02), side * (wide - 0.2)))
        s.box(
            (c, top + 0.93, -half - 0.4),
            (d, top + 1.03, half + 0.4),
            OLD_WOOD,
            at=at,
            faces=CLOSED,
            levels=(0.18, ENDLESS),
        )
    planks = round((2 * half + 1.0) / 0.5)
    for k in range(planks):
        z = -half - 0.5 + (k + 0.5) * (2 * half + 1.0) / planks
        s.box(
            (-wide - 0.08, top - 0.08, z - 0.2),
            (wide + 0.08, top + 0.05, z + 0.2),
            tone.shaded(dice.between(0.8, 1.15))._replace(grain=0.15),
            at=at,
            levels=(dice.between(0.6, 1.2), ENDLESS),
        )


def _canoes(s: Sketch, layout: Layout) -> None:
    """Boats in canals and on the lake; loaded ones carry baskets."""
    wet = layout.classes
    size = len(wet)
    for k in range(1500):
        dice = Dice(111, k)
        if k % 2:
            line = PITCH * dice.pick((-5, -3, -1, 1, 3, 5))
            x, z = line + dice.between(-1.8, 1.8), dice.between(-330, 330)
            along = (0.06 * dice.between(-1, 1), 1.0)
            if dice.chance(0.5):
                x, z, along = z, x, (1.0, along[0])
            if dice.chance(0.3):
                x, z = dice.pick((-13.5, 13.5)) + dice.between(-1.4, 1.4), dice.between(118, 330)
                along = (0.05 * dice.between(-1, 1), 1.0)
        else:
            x, z = dice.between(-520, 520), dice.between(-520, 520)
            a = dice.between(-1, 1)
            b = (1 - a * a) ** 0.5
            along = (a, b if dice.chance(0.5) else -b)
        half = dice.between(2.0, 3.4)
        if _open_water(wet, size, x, z, along, half + 0.5):
            if k % 2 == 0 and x * x + z * z < 360 * 360 and dice.chance(0.4):
                continue
            _canoe(s, x, z, along, half, dice)


def _open_water(
    wet: np.ndarray, size: int, x: float, z: float, along: tuple[float, float], half: float
) -> bool:
    n = (along[0] * along[0] + along[1] * along[1]) ** 0.5
    dx, dz = along[0] / n, along[1] / n
    for t in (-1.0, -0.5, 0.0, 0.5, 1.0):
        for side in (-0.8, 0.8):
            px, pz = x + dx * half * t - dz * side, z + dz * half * t + dx * side
            i, j = int(px + size // 2), int(pz + size // 2)
            if not (0 <= i < size and 0 <= j < size) or wet[j, i] > Ground.CANAL:
                return False
    return x * x + z * z < 530 * 530


def _canoe(
    s: Sketch, x: float, z: float, along: tuple[float, float], half: float, dice: Dice
) -> None:
    n = (along[0] * along[0] + along[1] * along[1]) ** 0.5
    dx, dz = along[0] / n, along[1] / n
    wide = dice.between(0.45, 0.62)
    tone = HULL.shaded(dice.between(0.7, 1.2))
    s.hull(
        (x, 0.34, z),
        (dx * half, dz * half),
        wide,
        tone,
        segments=(11.0, 6.0),
        levels=(dice.between(0.05, 0.35), ENDLESS),
    )
    turn = (dz, dx)
    for k in range(dice.whole(0, 3)):
        t = (k - 1) * 0.3 * half + dice.between(-0.2, 0.2)
        px, pz = x + dx * t, z + dz * t
        r = wide * 0.5
        s.box(
            (px - r, 0.03, pz - r),
            (px + r, dice.between(0.55, 0.85), pz + r),
            dice.pick((CLAY, LIME, WOOD, OLD_WOOD)).shaded(dice.between(0.8, 1.2)),
            turn=turn,
            taper=0.06,
            levels=(dice.between(0.3, 0.7), ENDLESS),
        )
    if dice.chance(0.25):
        level = dice.between(0.36, 0.5)
        cloth = Look(Material.CLOTH, dice.pick(CLOTHS), grain=0.6)
        r, h = wide * 0.72, 1.35
        p = [
            (x + dx * a * 1.0 - dz * b * r, h, z + dz * a * 1.0 + dx * b * r)
            for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))
        ]
        s.quad(p, cloth, sag=(0, 0.0, 0), levels=(level, ENDLESS), uv=(0, 1, 1, 0))
        for px, _, pz in p:
            s.box(
                (px - 0.04, 0.25, pz - 0.04),
                (px + 0.04, h + 0.02, pz + 0.04),
                OLD_WOOD,
                faces=SIDES,
                levels=(level, ENDLESS),
            )


def _market(s: Sketch, area: Rect) -> None:
    """Stalls in rows, wares on mats, a round stage in the middle."""
    y = HEIGHTS[Ground.MARKET]
    inner = area.inset(5.0)
    mx, mz = (area.x0 + area.x1) / 2, (area.z0 + area.z1) / 2
    s.lathe((mx, y - 0.2, mz), 5.5, 1.4, 0, STONE._replace(rough=0.0), sides=20, rings=1)
    s.lathe((mx, y + 1.2, mz), 5.5, 0.06, 1, LIME, sides=20, rings=2)
    s.box((mx - 0.2, y + 1.1, mz - 0.2), (mx + 0.2, y + 6.0, mz + 0.2), OLD_WOOD)
    nx, nz = int(inner.width / 5.2), int(inner.depth / 5.6)
    for i in range(nx):
        for j in range(nz):
            dice = Dice(121, i, j)
            x = inner.x0 + (i + 0.5) * inner.width / nx + dice.between(-0.5, 0.5)
            z = inner.z0 + (j + 0.5) * inner.depth / nz + dice.between(-0.5, 0.5)
            if (x - mx) ** 2 + (z - mz) ** 2 < 81 or dice.chance(0.08):
                continue
            _stall(s, Place(x, y, z, dice.whole(0, 3)), dice)


def _stall(s: Sketch, at: Place, dice: Dice) -> None:
    w, d = dice.between(1.1, 1.6), dice.between(0.9, 1.3)
    low, high = dice.between(1.9, 2.2), dice.between(2.4, 2.8)
    cloth = Look(Material.CLOTH, dice.pick(CLOTHS), grain=0.6)
    level = dice.between(0.02, 0.2)
    s.quad(
        ((-w, low, d), (w, low, d), (w, high, -d), (-w, high, -d)),
        cloth,
        at=at,
        uv=(0, 1.4, 1, 0),
        sag=(0, -0.22, 0),
        levels=(level, ENDLESS),
    )
    for x in (-w + 0.06, w - 0.06):
        for z, top in ((d - 0.06, low), (-d + 0.06, high)):
            s.box(
                (x - 0.05, -0.1, z - 0.05),
                (x + 0.05, top, z + 0.05),
                OLD_WOOD,
                at=at,
                faces=SIDES,
                levels=(level, ENDLESS),
            )
    s.box(
        (-w + 0.2, -0.05, -d * 0.3),
        (w - 0.2, 0.7, d * 0.5),
        WOOD.shaded(dice.between(0.7, 1.0)),
        at=at,
        levels=(0.25, ENDLESS),
    )
    goods = ("d8a23a", "b8452c", "6f8f3c", "e8dcc0", "7a4a2c", "d9743c", "c8b070")
    for k in range(7):
        x = -w + 0.4 + k * (2 * w - 0.8) / 6
        look = Look(Material.PLASTER, rgb(dice.pick(goods)))
        r = dice.between(0.12, 0.2)
        if k % 2:
            s.lathe(
                (x, 0.68, d * 0.1),
                r,
                r * 1.6,
                2,
                look,
                at=at,
                sides=6,
                rings=2,
                levels=(dice.between(0.7, 1.4), ENDLESS),
                lid=(0.61, 0.985, DARK),
            )
        else:
            s.box(
                (x - r, 0.65, d * 0.1 - r),
                (x + r, 0.7 + r, d * 0.1 + r),
                look,
                at=at,
                taper=r * 0.3,
                levels=(dice.between(0.5, 1.1), ENDLESS),
            )
    for _ in range(dice.whole(0, 3)):
        x, r = dice.between(-w, w), dice.between(0.2, 0.36)
        s.lathe(
            (x, -0.04, d + 0.3),
            r,
            r * 1.9,
            2,
            CLAY.shaded(dice.between(0.8, 1.3)),
            at=at,
            sides=7,
            rings=3,
            levels=(dice.between(0.6, 1.4), ENDLESS),
            lid=(0.61, 0.985, DARK),
        )


def _torches(s: Sketch, layout: Layout) -> None:
    """Posts with fire bowls along the avenues and causeways."""
    fire = Look(Material.PLASTER, rgb("ffa436"))
    for sign in (-1, 1):
        for k in range(34):
            z = sign * (120.0 + 14.0 * k)
            if any(abs(abs(z) - g) < 7 for g in (*GAPS, 168, 280)) or abs(z) > CAUSEWAY_END - 4:
                continue
            half = 9.2 if abs(z) < 336 else CAUSEWAY - 0.6
            y = HEIGHTS[Ground.AVENUE] if abs(z) < 336 else HEIGHTS[Ground.CAUSEWAY]
            for side in (-1, 1):
                for vertical in (True, False):
                    x = side * half
                    at = Place(x, y, z, 0) if vertical else Place(z, y, x, 0)
                    if not _paved(layout, at.x, at.z):
                        continue
                    if k % 2 and abs(z) < 336:
                        banner(s, at, 6.5, Dice(141, k, sign, side, int(vertical)))
                        continue
                    s.box((-0.3, -0.1, -0.3), (0.3, 0.5, 0.3), STONE, at=at, levels=(0.16, ENDLESS))
                    s.box(
                        (-0.09, 0.3, -0.09),
                        (0.09, 2.5, 0.09),
                        OLD_WOOD,
                        at=at,
                        levels=(0.16, ENDLESS),
                    )
                    s.lathe(
                        (0, 2.45, 0),
                        0.3,
                        0.4,
                        4,
                        CLAY,
                        at=at,
                        sides=7,
                        rings=2,
                        levels=(0.2, ENDLESS),
                        lid=(0.98, 0.98, DARK),
                    )
                    s.lathe(
                        (0, 2.75, 0),
                        0.2,
                        0.7,
                        6,
                        fire,
                        at=at,
                        sides=6,
                        rings=3,
                        levels=(0.22, ENDLESS),
                    )


def _kerbs(s: Sketch, layout: Layout) -> None:
    """Kerb stones and flower tubs along the avenues, mooring posts along their canals."""
    for sign in (-1, 1):
        for side in (-1, 1):
            for vertical in (True, False):
                for k in range(107):
                    dice = Dice(131, k, sign, side, int(vertical))
                    z = sign * (118.0 + 2.0 * k)
                    at = Place(0.0, HEIGHTS[Ground.AVENUE], 0.0, 0 if vertical else 1)
                    x, _, y = at.point(side * 9.75, 0.0, z)
                    if not _paved(layout, x, y):
                        continue
                    near = [at.point(side * 10.5, 0.0, z + e) for e in (-1.6, 0.0, 1.6)]
                    if any(_bridged(layout, p[0], p[2]) for p in near):
                        continue
                    s.box(
                        (side * 9.75 - 0.2, -0.1, z - 0.88),
                        (side * 9.75 + 0.2, 0.34, z + 0.88),
                        STONE.shaded(dice.between(0.88, 1.08)),
                        at=at,
                        taper=0.03,
                        levels=(dice.between(0.2, 0.36), ENDLESS),
                    )
                    if k % 6 == 3:
                        s.lathe(
                            (side * 8.6, -0.03, z),
                            0.55,
                            0.85,
                            2,
                            CLAY,
                            at=at,
                            sides=10,
                            rings=4,
                            levels=(dice.between(0.3, 0.5), ENDLESS),
                            lid=(0.61, 0.985, DARK),
                        )
                    if k % 5 == 1:
                        s.box(
                            (side * 10.5 - 0.09, -2.0, z - 0.09),
                            (side * 10.5 + 0.09, -0.3, z + 0.09),
                            OLD_WOOD,
                            at=at,
                            levels=(dice.between(0.35, 0.7), ENDLESS),
                        )


def _paved(layout: Layout, x: float, z: float) -> bool:
    half = len(layout.classes) // 2
    return layout.classes[int(z + half), int(x + half)] in (Ground.AVENUE, Ground.CAUSEWAY)


def _bridged(layout: Layout, x: float, z: float) -> bool:
    return any(
        b.area.x0 - 0.6 < x < b.area.x1 + 0.6 and b.area.z0 - 0.6 < z < b.area.z1 + 0.6
        for b in layout.bridges
    )
