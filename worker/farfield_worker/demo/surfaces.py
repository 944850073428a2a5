"""Surfaces: what the city is made of, before it is cut into triangles.

A surface is a grid of patches over (u, v) in [0, 1]^2, u to the right and v upwards for who looks
at its front. It says how many segments it would like at level 1 and at which levels it exists, so
one table describes the city at every level of detail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

ENDLESS = 1e9


class Kind(IntEnum):
    """What the `shape` of a surface holds."""

    #: corners (0,0), (1,0), (1,1), (0,1)
    FLAT = 0
    #: the same, moved by `extra` * 4 u (1 - u) v: cloth that sags or flies
    SAGGING = 1
    #: the same, seen from `extra`: normals point away from there
    CARD = 2
    #: solid of revolution: base; (radius, height, profile); unused; unused
    LATHE = 3
    #: boat: middle at the waterline; half length vector; half width vector; (draught, rise, unused)
    HULL = 4
    #: corners as FLAT; y is the height of the land there
    LAND = 5


@dataclass
class Surfaces:
    """A table of n surfaces.

    Attributes:
        kind: (n,) uint8, a `Kind`.
        shape: (n, 4, 3) float, see `Kind`.
        extra: (n, 3) float, see `Kind`.
        uv: (n, 3, 2) float, texture coordinate at (0, 0), its change along u, along v.
        material: (n,) uint8.
        tint: (n, 3) float, linear.
        rough: (n,) float, amplitude of unevenness, metres.
        segments: (n, 2) float, wanted segments along u and v at level 1.
        rank: (n, 2) float in [0, 1), spreads the steps of rounding over the levels.
        levels: (n, 2) float, exists from the first (inclusive) to the second level.
    """

    kind: NDArray[np.uint8]
    shape: Floats
    extra: Floats
    uv: Floats
    material: NDArray[np.uint8]
    tint: Floats
    rough: Floats
    segments: Floats
    rank: Floats
    levels: Floats

    def __len__(self) -> int:
        return len(self.kind)

    def take(self, rows: ArrayLike) -> Surfaces:
        """Return the given rows, in that order (indices or a mask)."""
        index = np.asarray(rows)
        return Surfaces(**{f.name: getattr(self, f.name)[index] for f in fields(self)})

    def centres(self) -> Floats:
        """Middle of each surface's corners or its base, (n, 3) float."""
        cornered = np.isin(self.kind, (Kind.FLAT, Kind.SAGGING, Kind.CARD, Kind.LAND))
        total = self.shape[:, 0] + self.shape[:, 1] + self.shape[:, 2] + self.shape[:, 3]
        return np.where(cornered[:, None], total / 4, self.shape[:, 0])


def concatenate(tables: Sequence[Surfaces]) -> Surfaces:
    """Join tables, in order."""
    return Surfaces(
        **{f.name: np.concatenate([getattr(t, f.name) for t in tables]) for f in fields(Surfaces)}
    )


def linear(srgb: ArrayLike) -> Floats:
    """Approximate sRGB -> linear by a polynomial: no library's pow, so equal on every machine."""
    c = np.asarray(srgb, np.float64)
    return np.asarray(c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878))
