"""Layer borders as depths: what the shader compares, the depth buffer orders and culling sorts by.

A surface at distance Z has window depth near / Z (see gl.context): 1 at the near clip plane, 0 at
infinity. Layers are told apart by that very number, so nothing that belongs to one layer can ever
hide, by rounding, behind what a farther layer has left in the depth buffer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: The near clip plane as a share of the near border: fragments decide the border, not the clipper.
NEAR_CLIP = 0.99


def near_clip(borders: Sequence[float]) -> np.float32:
    """Distance of the near clip plane, metres."""
    return np.float32(NEAR_CLIP * borders[-1])


def border_depths(borders: Sequence[float]) -> NDArray[np.float32]:
    """Depths of the borders with infinity in front, (layers + 1,) float32, ascending.

    Layer i holds depths z with result[i] < z <= result[i + 1].
    """
    near = float(near_clip(borders))
    return np.concatenate([[0.0], near / np.asarray(borders, np.float64)]).astype(np.float32)
