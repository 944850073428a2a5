"""Trees, bushes and crops as cards that their texture's alpha cuts out.

A tree at low levels is two crossed pictures of the whole; above that cards of twigs surround them,
more and smaller ones as the level rises, so that outline and colour stay.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo import foliage
from farfield_worker.demo.foliage import picture_uv
from farfield_worker.demo.hashing import uniform
from farfield_worker.demo.looks import Material
from farfield_worker.demo.surfaces import ENDLESS, Floats, Kind, Surfaces, concatenate, linear

Counts = NDArray[np.int64]


class Species(IntEnum):
    """What grows."""

    WILLOW = 0
    BROAD = 1
    PALM = 2
    BUSH = 3
    AGAVE = 4
    MAIZE = 5
    FLOWERS = 6


#: cards at level 1 of a plant of usual size
_CARDS = np.array([48.0, 52.0, 18.0, 20.0, 5.0, 7.0, 6.0])


#: fewer cards than these are drawn as crossed pictures of the whole
_FEW = np.array([5, 5, 0, 4, 0, 0, 0])


#: never fewer cards than these
_LEAST = np.array([0, 0, 5, 0, 1, 1, 1])


#: half width of a picture of the whole over the radius of the crown in it
_MARGIN = np.array([1.45, 1.12, 1.0, 1.0, 1.0, 1.0, 1.0])


_WHOLE = np.array(
    [foliage.WILLOW, foliage.ROUND_TREE, foliage.REED, foliage.FLOWERS, 0, 0, 0], np.int64
)


_TWIG = np.array(
    [
        foliage.WILLOW_TWIG,
        foliage.BROAD_TWIG,
        foliage.FROND,
        foliage.BROAD_TWIG,
        foliage.REED,
        foliage.CORN,
        foliage.FLOWERS,
    ],
    np.int64,
)


_UV = np.array([picture_uv(k) for k in range(8)])


@dataclass
class Forest:
    """Every plant.

    Attributes:
        species: (n,) int.
        foot: (n, 3) float, metres.
        height: (n,) float, metres; for crops the height of a row.
        spread: (n,) float, radius of the crown; for crops half the length of a row.
        turn: (n, 2) float, unit vector in x and z.
        weight: (n,) float, cards over those of a plant in the city; 1 is usual.
        tint: (n, 3) float, linear.
    """

    species: Counts
    foot: Floats
    height: Floats
    spread: Floats
    turn: Floats
    weight: Floats
    tint: Floats

    def solids(self) -> list[tuple[float, float, float, float, float]]:
        """Boxes that cast the shadows of the larger trees."""
        out = []
        for k in np.flatnonzero(self.species <= Species.PALM):
            x, y, z = self.foot[k]
            r = self.spread[k] * (0.62 if self.species[k] != Species.PALM else 0.3)
            out.append((x - r, z - r, x + r, z + r, y + self.height[k] * 0.85))
        return out

    def _cards(self, level: float) -> Counts:
        size = np.where(
            self.species >= Species.MAIZE, self.spread / 6.0, self.spread * self.height / 16.0
        )
        size = np.where(self.species == Species.PALM, 1.0, np.clip(size, 0.3, 2.5))
        rank = uniform(131, np.arange(len(self.species)))
        wanted = _CARDS[self.species] * size * self.weight * level
        cards = np.floor(wanted + rank).astype(np.int64)
        few = cards < _FEW[self.species]
        return np.where(few, 0, np.maximum(cards, _LEAST[self.species]))

    def _core(self) -> Counts:
        """Pictures of the whole in each plant: two crossed, or one that faces the lake."""
        core = (self.species <= Species.BUSH) & (self.species != Species.PALM)
        return np.where(
            core, np.where((self.weight < 0.5) | (self.species == Species.BUSH), 1, 2), 0
        )

    def _sides(self, level: float) -> Counts:
        """Sides of trunks; 0 where the picture shows the trunk."""
        trunk = (self.species <= Species.PALM) & (self._cards(level) > 0)
        return np.where(trunk, np.clip(int(3 + 2 * level**0.5), 5, 12), 0)

    def _rings(self, level: float) -> int:
        return max(1, int(1.5 * level**0.5))

    def count(self, level: float) -> int:
        """Triangles at `level`."""
        cards = self._cards(level)
        core = np.where((self.species == Species.BUSH) & (cards > 0), 0, self._core())
        total = core + cards * np.where(self.species == Species.PALM, 2, 1)
        return int(2 * total.sum() + 2 * (self._sides(level) * self._rings(level)).sum())

    def level(self, triangles: float) -> float:
        """The level with about that many triangles."""
        low, high = 0.001, 200.0
        for _ in range(48):
            middle = (low * high) ** 0.5
            if self.count(middle) < triangles:
                low = middle
            else:
                high = middle
        return low

    def surfaces(self, level: float) -> Surfaces:
        """Cards and trunks at `level`; each has the segments it needs at level 1."""
        cards = self._cards(level)
        core = np.where((self.species == Species.BUSH) & (cards > 0), 0, self._core())
        parts = [self._crossed(core, level)]
        for species in Species:
            rows = np.flatnonzero((self.species == species) & (cards > 0))
            if len(rows):
                parts.append(self._leaves(species, rows, cards[rows]))
        trunks = np.flatnonzero(self._sides(level) > 0)
        if len(trunks):
            parts.append(self._trunks(trunks, level))
        return concatenate(parts)

    def _crossed(self, core: Counts, level: float) -> Surfaces:
        plant = np.repeat(np.arange(len(core)), core)
        k = np.arange(len(plant)) - np.repeat(np.cumsum(core) - core, core)
        d = self.turn[plant]
        d = np.where((k == 1)[:, None], np.stack([-d[:, 1], d[:, 0]], axis=1), d)
        full = np.where(self._cards(level)[plant] > 0, 0.84, 1.0)  # twigs cover it
        wide = self.spread[plant] * _MARGIN[self.species[plant]] * full
        side = np.stack([d[:, 0] * wide, np.zeros(len(plant)), d[:, 1] * wide], axis=1)
        up = np.zeros((len(plant), 3))
        up[:, 1] = self.height[plant] * 0.5 * (0.4 + 0.6 * full)
        middle = self.foot[plant] + up
        picture = _WHOLE[self.species[plant]]
        centre = self.foot[plant] + up * 0.9
        return self._table(plant, middle, side, up, picture, centre, k, 0.86)

    def _leaves(self, species: int, rows: Counts, cards: Counts) -> Surfaces:
        plant = np.repeat(rows, cards)
        k = np.arange(len(plant)) - np.repeat(np.cumsum(cards) - cards, cards)
        n = np.repeat(cards, cards).astype(np.float64)
        r = [uniform(141 + i, plant, k) for i in range(6)]
        if species == Species.PALM:
            return self._fronds(plant, k, r)
        if species >= Species.AGAVE:
            return self._rows(plant, k, n, r)
        h, w = self.height[plant], self.spread[plant]
        a, b, c = _on_sphere(r[0], r[1])
        depth = 0.45 + 0.5 * np.sqrt(r[2])  # most of the crown is near its surface
        if species == Species.WILLOW:
            low, high = 0.14, 1.0
        elif species == Species.BROAD:
            low, high = 0.3, 1.0
        else:
            low, high = 0.05, 1.0
        mid, half = (low + high) / 2, (high - low) / 2
        y = h * (mid + half * b * depth)
        # willows are widest below the middle
        taper = 1.0 - 0.35 * np.maximum(b, 0) if species == Species.WILLOW else 1.0
        reach = w * 0.9 * depth * taper
        middle = self.foot[plant] + np.stack([a * reach, y, c * reach], axis=1)
        centre = self.foot[plant].copy()
        centre[:, 1] += h * mid * 0.85
        # cards cover about three times the crown's outline, however many there are
        area = 2.6 * w * h * half * 2 / n
        size = np.sqrt(area) * (0.75 + 0.5 * r[3])
        size = np.minimum(size, w * 0.7)
        out = np.stack([a, 0.55 * b, c], axis=1)
        lean = np.stack([r[4] - 0.5, r[5] - 0.5, r[2] - 0.5], axis=1)
        normal = _unit(out + 0.9 * lean)
        upward = np.zeros_like(normal)
        upward[:, 1] = 1.0
        if species != Species.WILLOW:
            upward += 1.2 * (np.stack([r[5], r[3], r[0]], axis=1) - 0.5)
        side = _unit(_cross(upward, normal))
        up = _cross(normal, side)
        tall = 1.25 if species == Species.WILLOW else 0.85
        wide = 0.62
        picture = np.full(len(plant), _TWIG[species])
        shade = 0.62 + 0.42 * depth * (0.75 + 0.25 * b)
        return self._table(
            plant,
            middle,
            side * (size * wide)[:, None],
            up * (size * tall * 0.62)[:, None],
            picture,
            centre,
            k,
            shade,
        )

    def _fronds(self, plant: Counts, k: Counts, r: list[Floats]) -> Surfaces:
        """Each frond in two pieces: rising from the crown, then hanging."""
        top = self.foot[plant].copy()
        top[:, 1] += self.height[plant]
        angle = (k * 0.381966 + 0.05 * r[0]) % 1.0
        a, c = _circle(angle)
        rise = 0.85 - 1.05 * r[1]
        length = self.spread[plant] * (0.8 + 0.35 * r[2])
        out = np.stack([a, np.zeros_like(a), c], axis=1)
        side = np.stack([-c, np.zeros_like(a), a], axis=1) * (length * 0.2)[:, None]
        lift = np.zeros_like(out)
        lift[:, 1] = 1.0
        first = out * (length * 0.55)[:, None] + lift * (length * 0.42 * rise)[:, None]
        second = out * (length * 0.42)[:, None] + lift * (length * (0.1 * rise - 0.42))[:, None]
        middle = top + first
        tables = []
        for start, step, (low, high) in ((top, first, (0.0, 0.55)), (middle, second, (0.55, 1.0))):
            table = self._table(
                plant,
                start + step / 2,
                -side,
                step / 2,
                np.full(len(plant), foliage.FROND),
                top - lift * 2.0,
                k,
                0.85 + 0.15 * r[3],
            )
            bottom, v = table.uv[:, 0, 1].copy(), table.uv[:, 2, 1].copy()
            table.uv[:, 0, 1] = bottom + v * low
            table.uv[:, 2, 1] = v * (high - low)
            tables.append(table)
        return concatenate(tables)

    def _rows(self, plant: Counts, k: Counts, n: Floats, r: list[Floats]) -> Surfaces:
        """Crops: cards one after the other along a row, each a little turned."""
        species = self.species[plant]
        d = self.turn[plant]
        length = 2 * self.spread[plant]
        t = (k + 0.5 + 0.3 * (r[0] - 0.5)) / n - 0.5
        if species[0] == Species.AGAVE:
            length = np.zeros_like(length)
        middle = self.foot[plant].copy()
        middle[:, 0] += d[:, 0] * length * t + 0.25 * (r[1] - 0.5)
        middle[:, 2] += d[:, 1] * length * t + 0.25 * (r[2] - 0.5)
        height = self.height[plant] * (0.8 + 0.35 * r[3])
        swing = 1.1 * (r[4] - 0.5)
        dx, dz = d[:, 0] - swing * d[:, 1], d[:, 1] + swing * d[:, 0]
        if species[0] == Species.AGAVE:
            dx, dz = _circle((k / n * 0.5 + 0.1 * r[4]) % 1.0)
        norm = np.sqrt(dx * dx + dz * dz)
        half = np.where(length > 0, length / n * 0.62, self.spread[plant])
        half = np.minimum(half, np.where(species == Species.AGAVE, 9.0, height * 0.9 + 0.2))
        half = np.where(length > 0, np.maximum(half, length / n * 0.5), half)
        side = np.stack([dx / norm * half, np.zeros_like(half), dz / norm * half], axis=1)
        up = np.zeros_like(side)
        up[:, 1] = height / 2
        middle[:, 1] += height / 2 - 0.03
        centre = middle.copy()
        centre[:, 1] -= 2.0 * height
        return self._table(plant, middle, side, up, _TWIG[species], centre, k, 0.85 + 0.2 * r[5])

    def _trunks(self, rows: Counts, level: float) -> Surfaces:
        n = len(rows)
        shape = np.zeros((n, 4, 3))
        shape[:, 0] = self.foot[rows]
        shape[:, 0, 1] -= 0.2
        palm = self.species[rows] == Species.PALM
        broad = self.species[rows] == Species.BROAD
        shape[:, 1, 0] = np.where(palm, 0.2, 0.024 * self.height[rows] + 0.03)
        part = np.where(palm, 1.0, np.where(broad, 0.42, 0.3))
        shape[:, 1, 1] = self.height[rows] * part + 0.25
        shape[:, 1, 2] = 5
        uv = np.zeros((n, 3, 2))
        uv[:, 1, 0] = 0.5
        uv[:, 2, 1] = 1.5
        uv = uv[:, :, ::-1].copy()  # bark runs up the trunk
        sides = np.clip(int(3 + 2 * level**0.5), 5, 12)
        return Surfaces(
            kind=np.full(n, Kind.LATHE, np.uint8),
            shape=shape,
            extra=np.zeros((n, 3)),
            uv=uv,
            material=np.full(n, Material.WOOD, np.uint8),
            tint=np.tile(linear((0.56, 0.47, 0.38)), (n, 1)),
            rough=np.zeros(n),
            segments=np.tile([float(sides), float(self._rings(level))], (n, 1)),
            rank=np.full((n, 2), 0.5),
            levels=np.tile([0.0, ENDLESS], (n, 1)),
        )

    def _table(
        self,
        plant: Counts,
        middle: Floats,
        side: Floats,
        up: Floats,
        picture: Counts,
        centre: Floats,
        k: Counts,
        shade: Floats | float = 1.0,
    ) -> Surfaces:
        shape = np.stack(
            [middle - side - up, middle + side - up, middle + side + up, middle - side + up], axis=1
        )
        # turn each card's front away from the crown's middle
        normal = _cross(side, up)
        away = middle - centre
        back = (normal * away).sum(axis=1) < 0
        shape[back] = shape[back][:, [1, 0, 3, 2]]
        uv4 = _UV[picture]
        n = len(plant)
        uv = np.zeros((n, 3, 2))
        flip = uniform(151, plant, k) < 0.5
        uv[:, 0, 0] = np.where(flip, uv4[:, 1], uv4[:, 0])
        uv[:, 0, 1] = uv4[:, 2]
        uv[:, 1, 0] = np.where(flip, -1, 1) * (uv4[:, 1] - uv4[:, 0])
        uv[:, 2, 1] = uv4[:, 3] - uv4[:, 2]
        vary = 0.9 + 0.2 * uniform(152, plant, k)
        return Surfaces(
            kind=np.full(n, Kind.CARD, np.uint8),
            shape=shape,
            extra=centre,
            uv=uv,
            material=np.full(n, Material.FOLIAGE, np.uint8),
            tint=self.tint[plant] * (vary * shade)[:, None],
            rough=np.zeros(n),
            segments=np.ones((n, 2)),
            rank=np.full((n, 2), 0.0),
            levels=np.tile([0.0, ENDLESS], (n, 1)),
        )


def _unit(v: Floats) -> Floats:
    square = v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1] + v[:, 2] * v[:, 2]
    return np.asarray(v / np.sqrt(np.maximum(square, 1e-30))[:, None])


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )


def _circle(t: Floats) -> tuple[Floats, Floats]:
    """Points on the unit circle for t in [0, 1)."""
    return np.cos(2 * np.pi * t), np.sin(2 * np.pi * t)


def _on_sphere(r: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
    y = 2 * r - 1
    flat = np.sqrt(np.maximum(1 - y * y, 0))
    a, c = _circle(s)
    return flat * a, y, flat * c
