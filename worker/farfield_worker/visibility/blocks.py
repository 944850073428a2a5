"""Which of a scene's triangles may show on a face: whole blocks, by their bounds."""

from __future__ import annotations

import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def blocks_in_view(scene: PreparedScene, eye: Floats, face: int, nearest: float) -> NDArray[np.int64]:
    """Blocks that may show on `face` of `eye` (3,) beyond Z = `nearest`, nearest first: (k,) int.

    A block is left out where its bounds lie behind one of the face's four sides or before
    `nearest`.
    """
    low = np.array([b.low for b in scene.info.blocks]).reshape(-1, 3)
    high = np.array([b.high for b in scene.info.blocks]).reshape(-1, 3)
    e = np.asarray(eye, np.float64) - scene.origin
    axes = FACES[face]
    shown = _reach(low - e, high - e, axes.forward) >= nearest
    for side in (axes.right, -axes.right, axes.down, -axes.down):
        shown &= _reach(low - e, high - e, axes.forward + side) >= 0
    distance = np.maximum(np.maximum(low - e, e - high), 0.0).max(axis=1, initial=0.0)
    which = np.flatnonzero(shown)
    return which[np.argsort(distance[which], kind="stable")]


def ranges_in_view(scene: PreparedScene, eye: Floats, face: int, nearest: float) -> NDArray[np.int64]:
    """Triangle ranges of `blocks_in_view` by batch: (k, 3) int, batch, first triangle, triangles."""
    ranges = [
        (part.batch, part.first_triangle, part.triangles)
        for block in blocks_in_view(scene, eye, face, nearest)
        for part in scene.info.blocks[block].parts
    ]
    table = np.array(ranges, np.int64).reshape(-1, 3)
    return table[np.argsort(table[:, 0], kind="stable")]


def _reach(low: Floats, high: Floats, direction: Floats) -> Floats:
    """Greatest value of `direction` . p over each box (n, 3), (n, 3): (n,) float."""
    return np.asarray(np.where(direction > 0, high, low) @ direction)
