"""Layer borders as disparities: what the shader compares and what culling sorts by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: The near clip plane as a share of the near border: fragments decide the border, not the clipper.
NEAR_CLIP = 0.99


def near_clip(borders: Sequence[float]) -> np.float32:
    """Distance of the near clip plane, metres."""
    return np.float32(NEAR_CLIP * borders[-1])


def layer_disparities(borders: Sequence[float]) -> NDArray[np.float32]:
    """Disparities of the borders with infinity in front, (layers + 1,) float32, ascending.

    Layer i holds disparities d with result[i] < d <= result[i + 1].
    """
    return np.concatenate([[0.0], 1.0 / np.asarray(borders, np.float64)]).astype(np.float32)
