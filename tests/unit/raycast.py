"""The slow, obvious renderer: every ray against every triangle (Moeller and Trumbore, 1997)."""

from __future__ import annotations

from typing import NamedTuple

import farfield_shading as shading
import numpy as np
from farfield_core.scene import Batch, PreparedScene
from numpy.typing import NDArray


class Hits(NamedTuple):
    """Hits of n rays with m triangles: distances along the rays, (n, m), inf where there are none,
    and the colours of the triangles from the side that is hit, (n, m, 3) uint8 sRGB.
    """

    distance: NDArray[np.float64]
    color: NDArray[np.uint8]


def cast(
    scene: PreparedScene,
    eye: NDArray[np.float64],
    directions: NDArray[np.float64],
    pixels: NDArray[np.int64],
) -> Hits:
    """Cast rays from `eye` along `directions` (n, 3); distances count in their lengths.

    `pixels` (n, 2) are the rays' pixels, for dithering. Triangles must have one colour and no
    texture each.
    """
    batches = batch_of_triangles(scene)
    corners = scene.positions[scene.triangles].astype(np.float64) + scene.origin - eye
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], e2[None])
    det = (p * e1).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = -(p * a).sum(-1) / det
        q = np.cross(-a, e1)
        v = (directions[:, None] * q).sum(-1) / det
        t = (e2 * q).sum(-1) / det
    hit = (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    front = det > 0
    first = scene.triangles[:, 0]
    normals = scene.normals[first, :3] / 127.0
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    linear = scene.colors[first] / 65535.0
    light = shading.default_light()
    color = np.zeros((2, len(first), 3))
    for number, batch in enumerate(scene.info.batches):
        rows = batches == number
        for side, sign in enumerate((-1.0, 1.0)):
            color[side, rows] = shading.shade(
                light,
                linear[rows, :3],
                normals[rows] * sign,
                np.asarray(batch.emissive),
                batch.unlit,
            )
        hit[:, rows] &= _drawn(batch, front[:, rows], linear[rows, 3], pixels)
    bytes_ = np.rint(shading.to_srgb(color) * 255).astype(np.uint8)
    return Hits(
        np.where(hit, t, np.inf), np.where(front[..., None], bytes_[1][None], bytes_[0][None])
    )


def batch_of_triangles(scene: PreparedScene) -> NDArray[np.int64]:
    """The batch of each triangle, (m,)."""
    batches = np.empty(len(scene.triangles), np.int64)
    for block in scene.info.blocks:
        for part in block.parts:
            batches[part.first_triangle : part.first_triangle + part.triangles] = part.batch
    return batches


def _drawn(
    batch: Batch,
    front: NDArray[np.bool_],
    alpha: NDArray[np.float64],
    pixels: NDArray[np.int64],
) -> NDArray[np.bool_]:
    drawn = np.ones_like(front) if batch.double_sided else front
    if batch.alpha == "mask":
        return drawn & (alpha >= batch.cutoff)
    if batch.alpha == "dither":
        return drawn & shading.dither(alpha[None], pixels[:, :1], pixels[:, 1:])
    return drawn


def stable(answers: list[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Where the answers of slightly different rays agree, elementwise: no edge runs close by."""
    low, high = np.min(answers, axis=0), np.max(answers, axis=0)
    return np.isinf(low) | (np.isfinite(high) & (high <= 1.01 * low))


#: offsets of the rays that `stable` compares, pixels
JITTER = ((0.0, 0.0), (0.02, 0.01), (-0.02, 0.01), (0.01, -0.02), (-0.01, -0.02))
