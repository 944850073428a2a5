"""Where a picture is taken from, and the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from farfield_core.errors import BadInputError
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A square picture seen from `eye`.

    Attributes:
        eye: (3,) scene coordinates.
        yaw: radians; 0 looks along -z, positive turns left (counter-clockwise from above).
        pitch: radians, positive looks up.
        fov: horizontal and vertical angle of view, degrees.
        size: pixels across.
        near: near clip, metres; None leaves it to what is shot.
        jitter: by how many pixels (x, y) samples lie right of and below the pixels' centres.
    """

    eye: tuple[float, float, float]
    yaw: float
    pitch: float
    fov: float = 60.0
    size: int = 512
    near: float | None = None
    jitter: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse what no camera can be; raises BadInputError."""
        if not all(math.isfinite(n) for n in (*self.eye, self.yaw, self.pitch)):
            raise BadInputError("A view needs finite numbers for --eye and --look.")
        if not 0.0 < self.fov < 180.0:
            raise BadInputError(
                f"A field of view of {self.fov:g} degrees is not between 0 and 180."
            )
        if not 1 <= self.size <= 16384:
            raise BadInputError(f"A picture of {self.size} pixels is not between 1 and 16384.")

    @property
    def focal(self) -> float:
        """Distance of the picture plane at which the picture is 2 wide."""
        return 1.0 / math.tan(math.radians(self.fov) / 2.0)

    def axes(self) -> tuple[Floats, Floats, Floats]:
        """Unit vectors right, up and forward, each (3,)."""
        sin_yaw, cos_yaw = math.sin(self.yaw), math.cos(self.yaw)
        sin_pitch, cos_pitch = math.sin(self.pitch), math.cos(self.pitch)
        right = np.array([cos_yaw, 0.0, -sin_yaw])
        forward = np.array([-sin_yaw * cos_pitch, sin_pitch, -cos_yaw * cos_pitch])
        return right, np.cross(right, forward), forward


class NearField(NamedTuple):
    """The near-field cube: `centre` (3,) scene coordinates and half width, metres."""

    centre: tuple[float, float, float]
    half_width: float


class Picture(NamedTuple):
    """One picture, top row first.

    Attributes:
        rgba: (h, w, 4) uint8, sRGB over the sky; alpha is 255 where there is geometry, else 0.
        far: (h, w) bool, where far field shows: geometry outside the near field, or a quad.
    """

    rgba: NDArray[np.uint8]
    far: NDArray[np.bool_]
