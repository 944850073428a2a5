"""Building a table of surfaces from boxes, quads, lathes and hulls, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farfield_worker.demo.hashing import Dice, uniform
from farfield_worker.demo.looks import TILE, Look, Material
from farfield_worker.demo.surfaces import ENDLESS, Floats, Kind, Surfaces, concatenate, linear

Point = tuple[float, float, float]
Levels = tuple[float, float]

ALWAYS: Levels = (0.0, ENDLESS)
#: faces of a box
EAST, WEST, SOUTH, NORTH, TOP, BOTTOM = 1, 2, 4, 8, 16, 32
SIDES = EAST | WEST | SOUTH | NORTH
STANDING = SIDES | TOP
CLOSED = STANDING | BOTTOM

_TILES = np.array([TILE[m] for m in sorted(TILE)])


@dataclass(frozen=True)
class Place:
    """Where a piece stands: local x, y, z, turned by quarter turns (counter-clockwise from above).

    Local +z is its front: south for quarter 0, east for 1, north for 2, west for 3.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    quarter: int = 0

    def point(self, x: float, y: float, z: float) -> Point:
        """Scene coordinates of a local point."""
        x, z = ((x, z), (z, -x), (-x, -z), (-z, x))[self.quarter]
        return self.x + x, self.y + y, self.z + z


ORIGIN = Place()


def turned_faces(faces: int, quarter: int) -> int:
    """Faces of a box after quarter turns: south becomes east, east north, north west."""
    for _ in range(quarter):
        moved = faces & (TOP | BOTTOM)
        for before, after in ((EAST, NORTH), (NORTH, WEST), (WEST, SOUTH), (SOUTH, EAST)):
            moved |= after if faces & before else 0
        faces = moved
    return faces


class Sketch:
    """Collects shapes; `surfaces()` turns them into a table.

    `solids` are the boxes that cast shadows in the baked light: (n, 5) x0, z0, x1, z1, top.
    With `spread` every place has levels of its own, up to a third higher or lower, so that things
    of one kind do not all change at the same level.
    """

    def __init__(self, seed: int, spread: bool = False) -> None:
        self._seed = seed
        self._spread = spread
        self._boxes: list[tuple[float, ...]] = []
        self._shapes: list[tuple[float, ...]] = []
        self._tables: list[Surfaces] = []
        self.solids: list[tuple[float, float, float, float, float]] = []

    def _levels(self, at: Place, levels: Levels) -> Levels:
        if not self._spread:
            return levels
        factor = Dice(self._seed, round(at.x * 8), round(at.z * 8)).between(0.75, 1.33)
        return levels[0] * factor, levels[1] * factor

    def box(
        self,
        low: Point,
        high: Point,
        look: Look,
        *,
        at: Place = ORIGIN,
        top: Look | None = None,
        taper: float | tuple[float, float] = 0.0,
        levels: Levels = ALWAYS,
        faces: int = STANDING,
        solid: bool = False,
        turn: tuple[float, float] = (1.0, 0.0),
    ) -> None:
        """Add a box, narrower by `taper` on each side at its top, of yaw `turn` (cos, sin)."""
        (x0, y0, z0), (x1, y1, z1) = at.point(*low), at.point(*high)
        (x0, x1), (z0, z1) = sorted((x0, x1)), sorted((z0, z1))
        ax, az = (x1 - x0) / 2, (z1 - z0) / 2
        tx, tz = (taper, taper) if isinstance(taper, float | int) else taper
        if at.quarter % 2:
            tx, tz = tz, tx
        faces = turned_faces(faces, at.quarter)
        lid = top or look
        levels = self._levels(at, levels)
        self._boxes.append(
            (
                *(x0 + ax, z0 + az, y0, y1, ax, az, ax - tx, az - tz, *turn),
                *(look.material, *look.tint, lid.material, *lid.tint),
                *(look.grain, lid.grain, look.rough, *levels, faces),
            )
        )
        if solid:
            self.solids.append((x0, z0, x1, z1, y1))

    def quad(
        self,
        corners: Sequence[Point],
        look: Look,
        *,
        at: Place = ORIGIN,
        uv: tuple[float, float, float, float] | None = None,
        sag: Point | None = None,
        levels: Levels = ALWAYS,
    ) -> None:
        """Add a four-cornered surface, counter-clockwise from bottom left as seen from its front.

        `uv` is u at its left and right and v at its bottom and top; otherwise metres are used.
        """
        p = [at.point(*c) for c in corners]
        levels = self._levels(at, levels)
        kind = Kind.FLAT if sag is None else Kind.SAGGING
        self._shape(kind, p, sag or (0.0, 0.0, 0.0), look, uv, levels)

    def _shape(
        self,
        kind: Kind,
        points: Sequence[Point],
        extra: Point,
        look: Look,
        uv: tuple[float, float, float, float] | None,
        levels: Levels,
        segments: tuple[float, float] = (-1.0, -1.0),
    ) -> None:
        frame = (1.0, *uv) if uv else (0.0, 0.0, 0.0, 0.0, 0.0)
        flat = [c for p in points for c in p]
        self._shapes.append(
            (
                *(kind, *flat, *extra, look.material, *look.tint, look.grain, look.rough),
                *(*levels, *segments, *frame),
            )
        )

    def lathe(
        self,
        base: Point,
        radius: float,
        height: float,
        profile: int,
        look: Look,
        *,
        at: Place = ORIGIN,
        sides: float = 8.0,
        rings: float = 1.0,
        levels: Levels = ALWAYS,
        lid: tuple[float, float, Look] | None = None,
    ) -> None:
        """Add a solid of revolution; see `tessellate.PROFILES`.

        `lid` closes it: radius and height of a disc in parts of the whole, and its look.
        """
        if lid is not None:
            part, up, cover = lid
            x, y, z = base
            self.lathe(
                (x, y + height * up, z),
                radius * part,
                0.02,
                8,
                cover,
                at=at,
                sides=sides,
                rings=0.5,
                levels=levels,
            )
        levels = self._levels(at, levels)
        points = (at.point(*base), (radius, height, float(profile)), (0.0,) * 3, (0.0,) * 3)
        girth = 6.3 * radius / _TILES[look.material]
        uv = (0.0, girth, 0.0, -height / float(_TILES[look.material]))
        self._shape(Kind.LATHE, points, (0.0,) * 3, look, uv, levels, (sides, rings))

    def hull(
        self,
        middle: Point,
        along: tuple[float, float],
        width: float,
        look: Look,
        *,
        segments: tuple[float, float] = (6.0, 4.0),
        draught: float = 0.5,
        rise: float = 0.22,
        levels: Levels = ALWAYS,
    ) -> None:
        """Add a boat of half length vector `along` (x, z) and half width `width`."""
        length = (along[0] * along[0] + along[1] * along[1]) ** 0.5
        half = (-along[1] / length * width, 0.0, along[0] / length * width)
        points = (middle, (along[0], 0.0, along[1]), half, (draught, rise, 0.0))
        uv = (0.0, length, 0.0, 0.6)
        self._shape(Kind.HULL, points, (0.0,) * 3, look, uv, levels, segments)

    def has_content(self) -> bool:
        """Was anything added?"""
        return bool(self._boxes or self._shapes or self._tables)

    def add(self, table: Surfaces) -> None:
        """Add surfaces made elsewhere."""
        self._tables.append(table)

    def surfaces(self) -> Surfaces:
        """All surfaces so far; rank numbers depend on their order."""
        tables = list(self._tables)
        if self._boxes:
            tables.append(_box_faces(np.array(self._boxes, np.float64), self._seed))
        if self._shapes:
            tables.append(_shapes(np.array(self._shapes, np.float64), self._seed))
        return concatenate(tables)


# Corners of each face in box coordinates: (x, y, z) with -1 low, +1 high; u right, v up.
_FACE_CORNERS = np.array(
    [
        [(1, -1, 1), (1, -1, -1), (1, 1, -1), (1, 1, 1)],
        [(-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1)],
        [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
        [(1, -1, -1), (-1, -1, -1), (-1, 1, -1), (1, 1, -1)],
        [(-1, 1, 1), (1, 1, 1), (1, 1, -1), (-1, 1, -1)],
        [(-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)],
    ]
)
# Dimension (0 x, 1 y, 2 z) along u and v of each face.
_FACE_AXES = ((2, 1), (2, 1), (0, 1), (0, 1), (0, 2), (0, 2))


def _box_faces(b: Floats, seed: int) -> Surfaces:
    """Faces of boxes, from the rows that `Sketch.box` writes."""
    n = len(b)
    row = np.arange(n)
    rank = uniform(seed, 11, row[:, None], np.arange(3)[None])
    shift = uniform(seed, 12, row[:, None], np.arange(2)[None])
    length = np.stack([2 * b[:, 4], b[:, 3] - b[:, 2], 2 * b[:, 5]], axis=1)
    bits = b[:, 23].astype(np.int64)
    out = []
    for face in range(6):
        keep = np.flatnonzero(bits & (1 << face))
        if len(keep) == 0:
            continue
        k = b[keep]
        corners = np.empty((len(keep), 4, 3))
        for c in range(4):
            sx, sy, sz = _FACE_CORNERS[face, c]
            x = sx * (k[:, 4] if sy < 0 else k[:, 6])
            z = sz * (k[:, 5] if sy < 0 else k[:, 7])
            corners[:, c, 0] = k[:, 0] + x * k[:, 8] + z * k[:, 9]
            corners[:, c, 1] = k[:, 2] if sy < 0 else k[:, 3]
            corners[:, c, 2] = k[:, 1] - x * k[:, 9] + z * k[:, 8]
        lid = face >= 4
        material = k[:, 14 if lid else 10].astype(np.uint8)
        tint = k[:, 15:18] if lid else k[:, 11:14]
        tile = _TILES[material]
        u, v = _FACE_AXES[face]
        uv = np.zeros((len(keep), 3, 2))
        if lid:  # paving runs on from box to box
            uv[:, 0] = corners[:, 0][:, [0, 2]] / tile[:, None]
            uv[:, 1] = (corners[:, 1] - corners[:, 0])[:, [0, 2]] / tile[:, None]
            uv[:, 2] = (corners[:, 3] - corners[:, 0])[:, [0, 2]] / tile[:, None]
        else:
            uv[:, 0, 0] = shift[keep, 0]
            uv[:, 0, 1] = shift[keep, 1] - k[:, 2] / tile
            uv[:, 1, 0] = length[keep, u] / tile
            uv[:, 2, 1] = -length[keep, v] / tile
            # the grain of wood runs along posts
            upright = (material == Material.WOOD) & (length[keep, v] > length[keep, u])
            uv[upright] = uv[upright][:, :, ::-1]
        grain = k[:, 19 if lid else 18]
        out.append(
            Surfaces(
                kind=np.full(len(keep), Kind.FLAT, np.uint8),
                shape=corners,
                extra=np.zeros((len(keep), 3)),
                uv=uv,
                material=material,
                tint=linear(tint),
                rough=k[:, 20],
                segments=length[keep][:, [u, v]] * grain[:, None],
                rank=rank[keep][:, [u, v]],
                levels=k[:, 21:23],
            )
        )
    return concatenate(out)


def _shapes(s: Floats, seed: int) -> Surfaces:
    """Surfaces from the rows that `Sketch.quad`, `lathe` and `hull` write."""
    n = len(s)
    shape = s[:, 1:13].reshape(n, 4, 3)
    material = s[:, 16].astype(np.uint8)
    bottom, left = shape[:, 1] - shape[:, 0], shape[:, 3] - shape[:, 0]
    across = np.sqrt((bottom * bottom).sum(axis=1))
    up = np.sqrt((left * left).sum(axis=1))
    tile = _TILES[material]
    metres = s[:, 26] == 0
    uv = np.zeros((n, 3, 2))
    shift = uniform(seed, 13, np.arange(n)[:, None], np.arange(2)[None])
    uv[:, 0, 0] = np.where(metres, shift[:, 0], s[:, 27])
    uv[:, 0, 1] = np.where(metres, shift[:, 1], s[:, 29])
    uv[:, 1, 0] = np.where(metres, across / tile, s[:, 28] - s[:, 27])
    uv[:, 2, 1] = np.where(metres, -up / tile, s[:, 30] - s[:, 29])
    given = s[:, 24] >= 0
    segments = np.stack(
        [
            np.where(given, s[:, 24], across * s[:, 20]),
            np.where(given, s[:, 25], up * s[:, 20]),
        ],
        axis=1,
    )
    return Surfaces(
        kind=s[:, 0].astype(np.uint8),
        shape=shape,
        extra=s[:, 13:16],
        uv=uv,
        material=material,
        tint=linear(s[:, 17:20]),
        rough=s[:, 21],
        segments=segments,
        rank=np.where(  # what is round keeps its number of sides, so that lids fit
            (s[:, 0] == Kind.LATHE)[:, None],
            0.5,
            uniform(seed, 14, np.arange(n)[:, None], np.arange(2)[None]),
        ),
        levels=s[:, 22:24],
    )
