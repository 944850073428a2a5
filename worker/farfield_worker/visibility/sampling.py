"""What can be seen from anywhere in a view cell, sampled eye by eye until hardly anything is new.

The eyes are those of `from_region.cell_eyes`, then the points of an additive recurrence that fills
the cell evenly (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018: R3, from
the plastic number's next sibling). Each further eye is also a measurement: the share of its view
that shows something not known before is what leaving it out would have cost there. Sampling ends
when that share, averaged over the last eyes, is below a target.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from farfield_worker.visibility.from_region import cell_eyes
from farfield_worker.visibility.near_maps import NearMap, NearMapRenderer

Floats = NDArray[np.float64]

#: root of x^4 = x + 1, from which the recurrence has its steps
_ROOT = 1.2207440846057596
_STEPS = np.array([1 / _ROOT, 1 / _ROOT**2, 1 / _ROOT**3])
#: eyes that every cell is sampled from: centre, corners, middles of faces
FIXED = 15
#: eyes whose mean must reach the target
WINDOW = 6
#: texels across a map at least
LEAST = 128


class Effort(NamedTuple):
    """How carefully to sample.

    Attributes:
        scale: texels of a map : texels of a face.
        most: eyes at most.
        target: share of an eye's view that may be new at the end.
    """

    scale: float
    most: int
    target: float


EFFORTS: dict[Literal["fast", "on", "careful"], Effort] = {
    "fast": Effort(scale=0.5, most=FIXED, target=1.0),
    "on": Effort(scale=0.5, most=24, target=5e-5),
    "careful": Effort(scale=1.0, most=400, target=1e-6),
}


def map_resolution(effort: Effort, resolution: int) -> int:
    """Texels across a map for faces of `resolution` texels."""
    return max(round(effort.scale * resolution), LEAST)


class Watcher(Protocol):
    """Keeps account of what has been seen."""

    def look(self, eye: Floats, maps: Sequence[NearMap]) -> float:
        """Take in what `eye` (3,) sees, given its six near maps.

        Returns the share of the texels of the maps that show something not known before.
        """
        ...


def more_eyes(centre: Floats, half_extents: Floats, number: int) -> Floats:
    """Eyes spread evenly over a cell, (number, 3) float; the first ones are always the same."""
    n = np.arange(1, number + 1)[:, None]
    offsets = 2 * ((0.5 + _STEPS * n) % 1.0) - 1
    return np.asarray(centre + offsets * np.asarray(half_extents, np.float64))


def sample(
    renderer: NearMapRenderer,
    centre: Floats,
    half_extents: Floats,
    half_width: float,
    effort: Effort,
    watchers: Sequence[Watcher],
) -> int:
    """Show `watchers` what the cell's eyes see, near polygons as the renderer draws them.

    `centre` (3,), scene coordinates, `half_extents` (3,) the cell's, `half_width` the near field's.
    Returns the number of eyes.
    """
    renderer.enter(centre, half_width)
    new: list[float] = []
    eyes = [cell_eyes(centre, half_extents), more_eyes(centre, half_extents, effort.most)]
    for eye in np.concatenate(eyes)[: effort.most]:
        maps = [renderer.map(eye, face) for face in range(6)]
        new.append(sum(watcher.look(eye, maps) for watcher in watchers))
        if len(new) >= FIXED and np.mean(new[-WINDOW:]) <= effort.target:
            break
    return len(new)
