"""How far from its true disparity a texel may be drawn: the parallax bound of LEMI section 4.2.

Take an eye e, a direction w of length 1 along a face's axis, and a surface point P = e + w / d. Let
another eye of the view cell be x = e + q. Drawing P at disparity d' instead of d moves it along its
ray, and x sees it move by

    d theta / d d  =  |w x q| / |w - q d|^2

since |P - x| = |w - q d| / d. With w' = w - q d, whose component along the axis is 1 - q_z d, this
is |w' x q| / |w'|^2. Over all w' of that length along the axis its maximum is

    M(q) / (1 - q_z d),      M(q) = (|q| + l) / 2,      l = hypot(q_x, q_y)

Over the cell it is largest at a corner with the largest l, and at one of the two ends of q_z (it is
a convex function over an affine one, hence quasiconvex in q_z). With `ahead` = o and `behind` = s
the reach of the cell before and behind e along the axis, integrating from d to d' gives

    |ln(1 - o d') - ln(1 - o d)| <= ln k(o),    |ln(1 + s d') - ln(1 + s d)| <= ln k(s)
    ln k(q_z) = 4 atanh(t tan(alpha / 2)),      t = (|q| - l) / q_z

For the centre o = s = h, the first is the stricter one, and ln(1 - h d) = -ln g(1 / d): this is the
paper's ln k, and its layers are the planes d' = const at fixed distances.

Where 1 - o d <= 0, which happens for an eye off the centre and a surface beside the cell, the first
inequality says nothing. There |P - x| >= near - max(h) (near, the half width of the near field) and
|w' x q| <= |w'| |q| give d theta / d d <= |q| / (d (near - max(h))), that is

    |ln d' - ln d| <= alpha (near - max(h)) / |q|

Either bound alone guarantees alpha, so the wider one holds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from farfield_core.errors import BadInputError
from farfield_core.faces import FACES
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: share of the bound that sheets use: it brings the mean error down to that of 64 layers
DEFAULT_FACTOR = 0.68


class Steps(NamedTuple):
    """The constants of an interval: reaches of the cell, steps per (1 -+ reach d), and a ratio."""

    ahead: float
    behind: float
    up_ahead: float
    down_ahead: float
    up_behind: float
    down_behind: float
    ratio: float


@dataclass(frozen=True)
class Tolerance:
    """Intervals of disparity allowed on one face of one eye.

    Attributes:
        ahead, behind: how far the cell reaches before and behind the eye along the axis, metres.
        ln_ahead, ln_behind: steps allowed in ln(1 - ahead d) and ln(1 + behind d).
        ln_ratio: step allowed in ln d, whatever the other two say.
    """

    ahead: float
    behind: float
    ln_ahead: float
    ln_behind: float
    ln_ratio: float

    @classmethod
    def of(
        cls,
        face: int,
        eye: Sequence[float] | Floats,
        half_extents: Sequence[float] | Floats,
        alpha: float,
        near: float,
        factor: float = DEFAULT_FACTOR,
    ) -> Tolerance:
        """Tolerance on `face` of an `eye` (3,) relative to its cell's centre, metres.

        `half_extents` (3,) are the cell's, `alpha` the parallax bound in radians, `near` the half
        width of the near field, `factor` the share of the bound to use. Raises BadInputError if
        the near field does not reach outside the cell or the eye is not in it.
        """
        e, half = np.asarray(eye, np.float64), np.asarray(half_extents, np.float64)
        gap = near - float(half.max())
        if gap <= 0:
            raise BadInputError(
                f"A near field of {near:g} m does not reach outside the cell; "
                f"use more than {half.max():g} m."
            )
        if not factor > 0:
            raise BadInputError(f"A tolerance of {factor:g} of the bound leaves nothing; use 0.68.")
        if np.any(np.abs(e) > half * (1 + 1e-9)):
            raise BadInputError("The eye of a quad must lie in its view cell.")
        axes = FACES[face]
        h = float(half @ np.abs(axes.forward))
        across = math.hypot(
            *(float(half @ np.abs(axis) + abs(e @ axis)) for axis in (axes.right, axes.down))
        )
        ahead = max(h - float(e @ axes.forward), 0.0)
        behind = max(h + float(e @ axes.forward), 0.0)
        longest = math.hypot(across, max(ahead, behind))
        return cls(
            ahead,
            behind,
            factor * _ln_k(ahead, across, alpha),
            factor * _ln_k(behind, across, alpha),
            factor * alpha * gap / longest,
        )

    def interval(
        self, disparity: NDArray[np.floating], times: float = 1.0
    ) -> tuple[Floats, Floats]:
        """Lowest and highest disparity at which surfaces at `disparity` (...) may be drawn.

        `times` widens the tolerance. Both ends rise with the disparity, so that what is nearer is
        never drawn behind (slanted/segment.py). The lower end may be negative: infinitely far.
        """
        d = np.asarray(disparity, np.float64)
        low, high = np.empty(d.shape), np.empty(d.shape)
        _intervals(d.reshape(-1), self.steps(times), low.reshape(-1), high.reshape(-1))
        return low, high

    def steps(self, times: float = 1.0) -> Steps:
        """What `lowest` and `highest` need, for `times` the tolerance."""
        return Steps(
            self.ahead,
            self.behind,
            -_relative(-times * self.ln_ahead, self.ahead),
            _relative(times * self.ln_ahead, self.ahead),
            _relative(times * self.ln_behind, self.behind),
            -_relative(-times * self.ln_behind, self.behind),
            math.exp(times * self.ln_ratio),
        )


@njit(cache=True)
def lowest(d: float, steps: Any) -> float:
    """Lowest disparity at which a surface at disparity `d` may be drawn."""
    forward = max(1.0 - steps.ahead * d, 0.0)
    backward = 1.0 + steps.behind * d
    down = min(forward * steps.down_ahead, backward * steps.down_behind)
    return float(min(d - down, d / steps.ratio))


@njit(cache=True)
def highest(d: float, steps: Any) -> float:
    """Highest disparity at which a surface at disparity `d` may be drawn."""
    forward = max(1.0 - steps.ahead * d, 0.0)
    backward = 1.0 + steps.behind * d
    up = min(forward * steps.up_ahead, backward * steps.up_behind)
    return float(max(d + up, d * steps.ratio))


@njit(cache=True)
def _intervals(d: Any, steps: Any, low: Any, high: Any) -> None:
    for i in range(len(d)):
        low[i], high[i] = lowest(d[i], steps), highest(d[i], steps)


def _ln_k(reach: float, across: float, alpha: float) -> float:
    """Return ln k of the head for |q_z| = reach; for reach 0 the allowed |d' - d| itself."""
    if reach == 0:
        return 2.0 * math.tan(alpha / 2) / across
    return 4.0 * math.atanh((math.hypot(across, reach) - across) / reach * math.tan(alpha / 2))


def _relative(step: float, reach: float) -> float:
    """(exp(step) - 1) / reach, and `step` itself for reach 0 (see _ln_k)."""
    return math.expm1(step) / reach if reach > 0 else step
