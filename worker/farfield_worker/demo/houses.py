"""Houses: wings around a court, or a thatched hut in a garden."""

from __future__ import annotations

from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.layout import HEIGHTS, Ground, Layout, Parcel, Rect
from farfield_worker.demo.looks import (
    ADOBE,
    CLAY,
    CLOTHS,
    DARK,
    LIME,
    OLD_WOOD,
    THATCH,
    WALLS,
    Look,
    Material,
    Rgb,
)
from farfield_worker.demo.sketch import (
    NORTH,
    SIDES,
    SOUTH,
    STANDING,
    Place,
    Sketch,
    turned_faces,
)
from farfield_worker.demo.surfaces import ENDLESS
from farfield_worker.demo.wings import STREET, Wing


def house(sketch: Sketch, layout: Layout, parcel: Parcel, dice: Dice) -> None:
    """Fill a parcel with a court house."""
    gap = dice.between(0.15, 0.6)
    area = Rect(
        parcel.area.x0 + gap,
        parcel.area.z0 + dice.between(0.15, 0.6),
        parcel.area.x1 - dice.between(0.15, 0.6),
        parcel.area.z1 - dice.between(0.15, 0.6),
    )
    tint: Rgb = dice.pick(WALLS[: dice.whole(4, len(WALLS))])
    wall = ADOBE.tinted(*tint).shaded(dice.between(0.92, 1.04))
    layout.paint(parcel.area, Ground.COURT)
    front = parcel.front
    at = Place(0.0, 0.0, 0.0, front)
    # local frame: front at +z
    width, depth = (area.width, area.depth) if front % 2 == 0 else (area.depth, area.width)
    mx, mz = (area.x0 + area.x1) / 2, (area.z0 + area.z1) / 2
    at = Place(mx, 0.0, mz, front)
    w, d = width / 2, depth / 2
    thick = [dice.between(3.6, 5.2) for _ in range(4)]  # front, right, back, left
    if dice.chance(0.3):
        thick[dice.pick((1, 3))] = 0.0
    elif dice.chance(0.2):
        thick[0] = 0.0
    court_w, court_d = width - thick[1] - thick[3], depth - thick[0] - thick[2]
    if court_w < 3.0:
        thick[1] = 0.0
    if court_d < 3.0:
        thick[2] = 0.0
    rects = (
        (-w, d - thick[0], w, d),
        (w - thick[1], -d + thick[2], w, d - thick[0]),
        (-w, -d, w, -d + thick[2]),
        (-w, -d + thick[2], -w + thick[3], d - thick[0]),
    )
    storeys = [dice.chance(0.28) for _ in range(4)]
    talls = [dice.between(3.1, 3.9) + (dice.between(2.2, 2.9) if up else 0.0) for up in storeys]
    for k, (x0, z0, x1, z1) in enumerate(rects):
        if thick[k] == 0.0:
            if k != 0 or thick[2] > 0:
                inner = (-w + (thick[3] or 0.2), -d, w - (thick[1] or 0.2), d)
                _yard_wall(sketch, at, rects[k] if k % 2 else inner, k, wall, dice)
            continue
        (ax, _, az), (bx, _, bz) = at.point(x0, 0, z0), at.point(x1, 0, z1)
        body = Rect(min(ax, bx), min(az, bz), max(ax, bx), max(az, bz))
        seen = STANDING
        if k % 2:  # between the front and the back wing
            for end, face in ((0, SOUTH), (2, NORTH)):
                if thick[end] > 0 and talls[end] > talls[k] + 0.3:
                    seen &= ~face
        seen = turned_faces(seen, front)
        wing = Wing(sketch, body, STREET, STREET + talls[k], wall, dice, seen)
        layout.cover(body)
        outward = (front + k) % 4
        inward = (outward + 2) % 4
        wing.facade(outward, door=k == 0)
        wing.facade(inward, door=dice.chance(0.7))
        wing.roofscape()
    _court(sketch, at, (-w + thick[3], -d + thick[2], w - thick[1], d - thick[0]), dice)


def _yard_wall(
    s: Sketch, at: Place, rect: tuple[float, float, float, float], k: int, wall: Look, dice: Dice
) -> None:
    """A garden wall where a wing is missing, with a gate if it is the front."""
    x0, z0, x1, z1 = rect
    tall = STREET + dice.between(1.9, 2.5)
    t = 0.35
    if k % 2:
        x0, x1, z0, z1 = x0 + 0.05, x1 - 0.05, z0 - 0.1, z1 + 0.1
    else:
        z0, z1 = z0 + 0.08, z1 - 0.08
    if k == 0:
        m, gate = (x0 + x1) / 2, min(1.1, (x1 - x0) / 2 - 0.4)
        for a, b in ((x0, m - gate), (m + gate, x1)):
            s.box((a, STREET - 0.4, z1 - t), (b, tall, z1), wall, at=at)
        for x in (m - gate - 0.2, m + gate + 0.2):
            s.box(
                (x - 0.3, STREET - 0.4, z1 - 0.5),
                (x + 0.3, tall + 0.5, z1 + 0.12),
                wall.shaded(0.9),
                at=at,
                levels=(0.5, ENDLESS),
            )
        return
    line = {1: (x1 - t, z0, x1, z1), 3: (x0, z0, x0 + t, z1), 2: (x0, z0, x1, z0 + t)}[k]
    s.box((line[0], STREET - 0.4, line[1]), (line[2], tall, line[3]), wall, at=at)


def _court(s: Sketch, at: Place, rect: tuple[float, float, float, float], dice: Dice) -> None:
    """Things in a court: oven, trough, pots, a roof of cloth."""
    x0, z0, x1, z1 = rect[0] + 0.8, rect[1] + 0.8, rect[2] - 0.8, rect[3] - 0.8
    y = HEIGHTS[Ground.COURT]
    if x1 - x0 < 1.5 or z1 - z0 < 1.5:
        return
    if dice.chance(0.5):
        x, z = dice.between(x0, x1), dice.between(z0, z1)
        s.lathe(
            (x, y - 0.05, z),
            dice.between(0.8, 1.2),
            dice.between(0.9, 1.3),
            3,
            LIME.shaded(0.85)._replace(grain=0.0),
            at=at,
            sides=8,
            rings=3,
            levels=(dice.between(0.2, 0.4), ENDLESS),
        )
    for _ in range(dice.whole(1, 5)):
        x, z, r = dice.between(x0, x1), dice.between(z0, z1), dice.between(0.2, 0.45)
        s.lathe(
            (x, y - 0.03, z),
            r,
            r * dice.between(1.6, 2.3),
            2,
            CLAY.shaded(dice.between(0.75, 1.3)),
            at=at,
            sides=7,
            rings=3,
            levels=(dice.between(0.35, 0.9), ENDLESS),
            lid=(0.61, 0.985, DARK),
        )
    if dice.chance(0.35):
        w, d, h = dice.between(1.2, 1.8), dice.between(1.1, 1.6), y + dice.between(2.1, 2.5)
        x, z = (x0 + x1) / 2, (z0 + z1) / 2
        if x1 - x0 > 2 * w and z1 - z0 > 2 * d:
            cloth = Look(Material.CLOTH, dice.pick(CLOTHS), grain=0.8)
            level = dice.between(0.2, 0.4)
            s.quad(
                (
                    (x - w, h, z + d),
                    (x + w, h, z + d),
                    (x + w, h + 0.3, z - d),
                    (x - w, h + 0.3, z - d),
                ),
                cloth,
                at=at,
                uv=(0, 1.5, 1, 0),
                sag=(0, -0.2, 0),
                levels=(level, ENDLESS),
            )
            for px in (x - w + 0.05, x + w - 0.05):
                for pz, top in ((z + d - 0.05, h), (z - d + 0.05, h + 0.3)):
                    s.box(
                        (px - 0.05, y - 0.1, pz - 0.05),
                        (px + 0.05, top + 0.03, pz + 0.05),
                        OLD_WOOD,
                        at=at,
                        faces=SIDES,
                        levels=(level, ENDLESS),
                    )


def hut(sketch: Sketch, layout: Layout, parcel: Parcel, dice: Dice) -> None:
    """A thatched hut in a garden."""
    layout.paint(parcel.area, Ground.GARDEN)
    area = parcel.area
    for k in range(2 if area.width * area.depth > 260 else 1):
        w, d = dice.between(2.6, 3.4), dice.between(2.0, 2.6)
        mx = (area.x0 + area.x1) / 2 + dice.between(-1.5, 1.5)
        mz = (area.z0 + area.z1) / 2 + (k * 7.0 - 3.5 if area.width * area.depth > 260 else 0.0)
        thatched(sketch, Place(mx, STREET, mz, parcel.front), w, d, dice)


def thatched(sketch: Sketch, at: Place, w: float, d: float, dice: Dice) -> None:
    """A hut of half width w and half depth d with a hipped roof of straw."""
    tall, ridge = dice.between(2.1, 2.5), dice.between(1.9, 2.6)
    if at.quarter % 2:
        span = (at.x - d, at.z - w, at.x + d, at.z + w)
    else:
        span = (at.x - w, at.z - d, at.x + w, at.z + d)
    sketch.solids.append((*span, at.y + tall + 0.4 * ridge))
    wall = ADOBE.tinted(*dice.pick(WALLS[3:])).shaded(dice.between(0.8, 1.0))
    sketch.box((-w, -0.4, -d), (w, tall + 0.1, d), wall, at=at, faces=SIDES)
    sketch.box(
        (-0.6, 0.0, d - 0.2), (0.6, 1.85, d + 0.05), DARK, at=at, faces=SOUTH, levels=(0.2, ENDLESS)
    )
    for x in (-0.72, 0.72):
        sketch.box(
            (x - 0.1, 0.0, d - 0.1),
            (x + 0.1, 2.0, d + 0.1),
            OLD_WOOD,
            at=at,
            faces=STANDING & ~NORTH,
            levels=(0.5, ENDLESS),
        )
    e = 0.7
    y, top = tall - 0.35, tall + ridge
    r = w - d * 0.8
    straw = THATCH.shaded(dice.between(0.78, 1.08))
    p = {
        "sw": (-w - e, y, d + e),
        "se": (w + e, y, d + e),
        "ne": (w + e, y, -d - e),
        "nw": (-w - e, y, -d - e),
    }
    # the long slopes meet in the ridge; the hips end in a short edge across it
    a, b, e = (-r, top, 0.0), (r, top, 0.0), 0.02
    a2, b2, a3, b3 = (-r, top, e), (r, top, e), (-r, top, -e), (r, top, -e)
    for corners in (
        (p["sw"], p["se"], b, a),
        (p["ne"], p["nw"], a, b),
        (p["se"], p["ne"], b3, b2),
        (p["nw"], p["sw"], a2, a3),
        (p["nw"], p["ne"], p["se"], p["sw"]),
    ):
        sketch.quad(corners, straw, at=at)
    sketch.box(
        (-r - 0.25, top - 0.25, -0.28),
        (r + 0.25, top + 0.1, 0.28),
        straw.shaded(0.75),
        at=at,
        taper=(0.1, 0.14),
        levels=(0.45, ENDLESS),
    )


def houses(sketch: Sketch, layout: Layout) -> None:
    """Build on every parcel."""
    for k, parcel in enumerate(layout.parcels):
        dice = Dice(81, k)
        if parcel.rim and dice.chance(0.3):
            hut(sketch, layout, parcel, dice)
        elif min(parcel.area.width, parcel.area.depth) < 8:
            layout.paint(parcel.area, Ground.GARDEN)
        else:
            house(sketch, layout, parcel, dice)
