"""Positions on a grid of 16-bit steps that neighbouring blocks share (KHR_mesh_quantization).

Steps are powers of two and grids start at the scene's origin, so vertices on the common edge of two
blocks with the same step land on the same point and no crack opens between them. The step is the
same under all axes: a node's uneven scale would bend normals.
"""

from __future__ import annotations

import math

import numpy as np
from farfield_core.scene import Block, SceneInfo
from numpy.typing import NDArray

#: largest step count that 16 bits hold, less one for the grid's start being rounded down
_STEPS = 65534


def finest_step(extent: float) -> float:
    """Smallest power of two of which `_STEPS` cover `extent` metres."""
    if extent <= 0:
        return 2.0**-40
    return float(2.0 ** math.ceil(math.log2(extent / _STEPS)))


def common_step(info: SceneInfo) -> float:
    """Step that most blocks of a scene use: what the median block needs."""
    needs = sorted(finest_step(_extent(block)) for block in info.blocks)
    return needs[len(needs) // 2]


def quantise(
    positions: NDArray[np.float32], block: Block, common: float
) -> tuple[NDArray[np.uint16], tuple[float, float, float], float]:
    """Return (n, 3) uint16 steps, where step 0 lies, and the step, metres.

    A position is start + step * steps, off by half a step at most on each axis.
    """
    step = max(finest_step(_extent(block)), common)
    start = np.floor(np.asarray(block.low, np.float64) / step)
    steps = np.rint(positions.astype(np.float64) / step) - start
    x, y, z = (start * step).tolist()
    return steps.astype(np.uint16), (x, y, z), step


def _extent(block: Block) -> float:
    return max(high - low for low, high in zip(block.low, block.high, strict=True))
