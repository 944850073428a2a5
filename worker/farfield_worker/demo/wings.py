"""Wings: flat-roofed adobe bodies with doors, windows, beams, merlons and what lies on the roof.

Below a level of its own a wing is one block as high as its parapet; doors, then windows, beams,
merlons, frames and pots appear as the level rises, each house a little earlier or later than the
next.
"""

from __future__ import annotations

from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.layout import HEIGHTS, Ground, Rect
from farfield_worker.demo.looks import (
    BANDS,
    CLAY,
    CLOTHS,
    DARK,
    LIME,
    OLD_WOOD,
    WOOD,
    Look,
    Material,
    rgb,
)
from farfield_worker.demo.sketch import (
    CLOSED,
    EAST,
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
from farfield_worker.demo.surfaces import ENDLESS

STREET = HEIGHTS[Ground.STREET]


ROOF = Look(Material.STUCCO, rgb("e8d8ba"), grain=0.16)


class Wing:
    """One flat-roofed body and what is on it; x, z are scene coordinates."""

    def __init__(
        self,
        sketch: Sketch,
        area: Rect,
        foot: float,
        top: float,
        wall: Look,
        dice: Dice,
        seen: int = STANDING,
    ) -> None:
        """`seen`: faces that no other wing hides; the coarse body has only these."""
        self.sketch, self.area, self.foot, self.top = sketch, area, foot, top
        self.wall, self.dice, self.seen = wall, dice, seen
        self.parapet = dice.between(0.35, 0.6)
        self.full = dice.between(0.1, 0.2)
        self._body()

    def _body(self) -> None:
        s, (x0, z0, x1, z1) = self.sketch, self.area
        low = (x0, self.foot - 0.4, z0)
        rim = self.top + self.parapet
        coarse, fine = (0.0, self.full), (self.full, ENDLESS)
        roof = ROOF.shaded(self.dice.between(0.86, 1.05))
        s.box(low, (x1, rim, z1), self.wall, top=roof, levels=coarse, solid=True, faces=self.seen)
        # the walls run up to the rim in one piece; inside them the roof lies lower
        s.box(low, (x1, rim, z1), self.wall, faces=SIDES, levels=fine)
        t = 0.28
        s.box(
            (x0 + t, self.top - 1, z0 + t), (x1 - t, self.top, z1 - t), roof, faces=TOP, levels=fine
        )
        for strip, inside in (
            ((x0, z0, x1, z0 + t), SOUTH),
            ((x0, z1 - t, x1, z1), NORTH),
            ((x0, z0 + t, x0 + t, z1 - t), EAST),
            ((x1 - t, z0 + t, x1, z1 - t), WEST),
        ):
            s.box(
                (strip[0], self.top, strip[1]),
                (strip[2], rim, strip[3]),
                self.wall,
                faces=inside | TOP,
                levels=fine,
            )

    def side(self, front: int) -> tuple[Place, float, float]:
        """Frame with its origin at the middle of a wall's foot, its length and its height."""
        x0, z0, x1, z1 = self.area
        mx, mz = (x0 + x1) / 2, (z0 + z1) / 2
        at = ((mx, z1), (x1, mz), (mx, z0), (x0, mz))[front]
        length = self.area.width if front % 2 == 0 else self.area.depth
        return Place(at[0], self.foot, at[1], front), length, self.top - self.foot

    def opening(
        self, front: int, x: float, y: float, width: float, height: float, level: float, door: bool
    ) -> None:
        """A door or window: a dark panel between jambs under a lintel of wood."""
        s = self.sketch
        at, _, _ = self.side(front)
        h = width / 2
        panel = DARK.shaded(self.dice.between(0.8, 1.5))
        s.box(
            (x - h, y, -0.2),
            (x + h, y + height, 0.05),
            panel,
            at=at,
            faces=SOUTH,
            levels=(level, ENDLESS),
        )
        frame = level * 1.2 + 0.1
        after: Levels = (frame, ENDLESS)
        tone = OLD_WOOD.shaded(self.dice.between(0.75, 1.1))
        s.box(
            (x - h - 0.25, y + height, -0.1),
            (x + h + 0.25, y + height + 0.24, 0.13),
            tone,
            at=at,
            faces=CLOSED & ~NORTH,
            levels=after,
        )
        if door or self.dice.chance(0.6):
            jamb = self.wall.shaded(0.86)
            more: Levels = (frame * 1.8, ENDLESS)
            for side in (-1, 1):
                a, b = sorted((x + side * h, x + side * (h + 0.18)))
                s.box(
                    (a, y, -0.1),
                    (b, y + height, 0.1),
                    jamb,
                    at=at,
                    faces=STANDING & ~NORTH,
                    levels=more,
                )
        if door:
            s.box(
                (x - h - 0.3, -0.3, -0.2),
                (x + h + 0.3, self.dice.between(0.1, 0.2), 0.55),
                STONE_STEP,
                at=at,
                faces=STANDING & ~NORTH,
                levels=(frame, ENDLESS),
            )
            if self.dice.chance(0.35):
                cloth = Look(Material.CLOTH, self.dice.pick(CLOTHS), grain=0.8)
                s.quad(
                    (
                        (x - h, y + 0.3, 0.08),
                        (x + h * 0.3, y + 0.35, 0.09),
                        (x + h * 0.4, y + height, 0.07),
                        (x - h, y + height, 0.07),
                    ),
                    cloth,
                    at=at,
                    uv=(0, 0.5, 1, 0.2),
                    levels=(frame * 1.1, ENDLESS),
                )
        elif self.dice.chance(0.55):
            s.box(
                (x - h - 0.12, y - 0.14, -0.1),
                (x + h + 0.12, y, 0.16),
                tone,
                at=at,
                faces=CLOSED & ~NORTH,
                levels=(frame * 1.5, ENDLESS),
            )

    def facade(self, front: int, door: bool) -> None:
        """Openings, beams, a painted band and merlons on one side."""
        s, dice = self.sketch, self.dice
        at, length, height = self.side(front)
        if length < 2.2:
            return
        if dice.chance(0.45):
            band = LIME.tinted(*dice.pick(BANDS))._replace(rough=self.wall.rough, grain=0.14)
            tall = dice.between(0.5, 1.1)
            e = length / 2 - 0.02
            s.box(
                (-e, -0.3, -0.1),
                (e, tall, 0.06),
                band,
                at=at,
                faces=STANDING & ~NORTH,
                levels=(dice.between(0.2, 0.4), ENDLESS),
            )
        slots = max(1, int((length - 0.8) / dice.between(2.3, 3.3)))
        pitch = length / slots
        entrance = slots // 2 if door else -1
        storeys = max(1, int((height - 0.4) / 2.7))
        for storey in range(storeys):
            base = storey * height / storeys
            for k in range(slots):
                x = (k + 0.5) * pitch - length / 2 + dice.between(-0.25, 0.25)
                if storey == 0 and (k == entrance or (entrance < 0 and dice.chance(0.12))):
                    wide = dice.between(1.0, 1.5)
                    tall = min(dice.between(1.95, 2.3), height - 0.7)
                    self.opening(front, x, 0.02, wide, tall, dice.between(0.06, 0.16), True)
                    if door and k == entrance and dice.chance(0.4):
                        self.awning(at, x, tall + 0.45, wide)
                elif dice.chance(0.62):
                    tall = dice.between(0.6, 1.05)
                    y = base + min(dice.between(1.2, 1.5), height / storeys - tall - 0.5)
                    self.opening(
                        front, x, y, dice.between(0.55, 0.95), tall, dice.between(0.1, 0.26), False
                    )
        if dice.chance(0.65):
            self.beams(at, length, height)
        self.crown(at, length, height)

    def awning(self, at: Place, x: float, y: float, wide: float) -> None:
        """A cloth on two poles over the door."""
        s, dice = self.sketch, self.dice
        w, d = wide / 2 + dice.between(0.5, 1.0), dice.between(1.4, 2.2)
        cloth = Look(Material.CLOTH, dice.pick(CLOTHS), grain=0.9)
        low = y - 0.35
        level = dice.between(0.16, 0.36)
        s.quad(
            ((-w + x, low, d), (w + x, low, d), (w + x, y, 0.06), (-w + x, y, 0.06)),
            cloth,
            at=at,
            uv=(0, w, 1, 0),
            sag=(0.0, -0.18, 0.0),
            levels=(level, ENDLESS),
        )
        for side in (-1, 1):
            px = x + side * (w - 0.06)
            s.box(
                (px - 0.05, -0.2, d - 0.1),
                (px + 0.05, low + 0.02, d),
                OLD_WOOD,
                at=at,
                faces=SIDES,
                levels=(level, ENDLESS),
            )

    def beams(self, at: Place, length: float, height: float) -> None:
        """Round beams that carry the roof and stick out under it."""
        dice = self.dice
        count = max(2, int(length / dice.between(1.0, 1.4)))
        tone = WOOD.shaded(dice.between(0.65, 0.95))._replace(grain=0.0)
        reach = dice.between(0.28, 0.5)
        y = height - 0.5
        for k in range(count):
            x = (k + 0.5) / count * length - length / 2
            # every other one earlier, so that rows grow denser
            level = (0.24 if k % 2 else 0.38) + dice.between(-0.06, 0.1)
            self.sketch.box(
                (x - 0.09, y, -0.1),
                (x + 0.09, y + 0.18, reach),
                tone,
                at=at,
                faces=CLOSED & ~NORTH,
                levels=(level, ENDLESS),
            )

    def crown(self, at: Place, length: float, height: float) -> None:
        """What stands on the parapet of one side: merlons, a cornice, or nothing."""
        dice, s = self.dice, self.sketch
        style = dice.whole(0, 4)
        y = height + self.parapet
        if style <= 1:
            count = max(2, int(length / 1.45))
            level = dice.between(0.2, 0.4)
            e = min(0.32, length / count * 0.3)
            for k in range(count):
                x = (k + 0.5) / count * length - length / 2
                tall = 0.42 if style else 0.34
                s.box(
                    (x - e, y - 0.02, -0.27),
                    (x + e, y + tall, -0.01),
                    self.wall,
                    at=at,
                    taper=(0.0, 0.0) if style else (e * 0.55, 0.02),
                    levels=(level, ENDLESS),
                )
        elif style == 2:
            s.box(
                (-length / 2 - 0.07, y - 0.2, -0.3),
                (length / 2 + 0.07, y + 0.06, 0.08),
                self.wall.shaded(0.92),
                at=at,
                faces=CLOSED,
                levels=(self.full, ENDLESS),
            )

    def roofscape(self) -> None:
        """Hatch, pots, mats, a ladder's end on the roof."""
        s, dice = self.sketch, self.dice
        x0, z0, x1, z1 = self.area.inset(0.7)
        if x1 - x0 < 1.5 or z1 - z0 < 1.5:
            return
        if dice.chance(0.3):
            x, z = dice.between(x0, x1 - 1.2), dice.between(z0, z1 - 1.2)
            s.box(
                (x, self.top - 0.05, z),
                (x + 1.2, self.top + dice.between(0.5, 0.9), z + 1.2),
                self.wall.shaded(0.93),
                levels=(dice.between(0.2, 0.4), ENDLESS),
            )
        for _ in range(dice.whole(0, 4)):
            x, z, r = dice.between(x0, x1), dice.between(z0, z1), dice.between(0.18, 0.38)
            s.lathe(
                (x, self.top - 0.02, z),
                r,
                r * dice.between(1.7, 2.4),
                2,
                CLAY.shaded(dice.between(0.8, 1.3)),
                sides=7,
                rings=3,
                levels=(dice.between(0.35, 0.9), ENDLESS),
                lid=(0.61, 0.985, DARK),
            )
        if dice.chance(0.35):
            x, z = dice.between(x0, x1 - 1.0), dice.between(z0, z1 - 1.0)
            y = self.top + 0.06
            a, b = dice.between(0.8, 1.8), dice.between(0.8, 1.8)
            mat = Look(Material.CLOTH, dice.pick(CLOTHS), grain=0.6)
            s.quad(
                ((x, y, z + b), (x + a, y, z + b), (x + a, y + 0.05, z), (x, y + 0.05, z)),
                mat,
                uv=(0, 1, 1, 0),
                levels=(dice.between(0.35, 0.8), ENDLESS),
            )


STONE_STEP = Look(Material.STONE, rgb("c8bba0"), grain=0.2)
