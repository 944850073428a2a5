"""Near polygons for an ordinary viewer: cut off at the near field, their light painted on.

Readers of walks clip near polygons in the shader and light them by Farfield's own model. Here
triangles are clipped against the cube (Sutherland and Hodgman 1974), and what the light does to a
corner goes into its colour; the material is unlit. Emission is left out: unlit materials have none.
"""

from __future__ import annotations

from typing import Any

import farfield_shading as shading
import numpy as np
from numpy.typing import NDArray

from farfield_worker.shoot.glb import Material

Arrays = dict[str, NDArray[Any]]


def clipped(arrays: Arrays, half_width: float) -> Arrays:
    """The part of a mesh within `half_width` of the origin; see `shoot.near.merge_near`."""
    names = ("position", "normal", "uv", "color")
    corners = np.concatenate([arrays[n].astype(np.float64) for n in names], axis=1)
    triangles = arrays["triangles"]
    reach = corners[triangles, :3]
    out = ((reach.max(axis=1) < -half_width) | (reach.min(axis=1) > half_width)).any(axis=1)
    crossing = ~out & (np.abs(reach).max(axis=(1, 2)) > half_width)
    extra, fans = [np.zeros((0, corners.shape[1]))], [np.zeros((0, 3), np.int64)]
    count = len(corners)
    for triangle in triangles[crossing]:
        polygon = corners[triangle]
        for axis in range(3):
            for sign in (-1.0, 1.0):
                polygon = _half_space(polygon, half_width + sign * polygon[:, axis])
        if len(polygon) < 3:
            continue
        step = np.arange(1, len(polygon) - 1)
        fans.append(count + np.stack([0 * step, step, step + 1], axis=1))
        extra.append(polygon)
        count += len(polygon)
    corners = np.concatenate([corners, *extra])
    whole = triangles[~out & ~crossing].astype(np.int64)
    used, index = np.unique(np.concatenate([whole, *fans]), return_inverse=True)
    widths = np.cumsum([arrays[n].shape[1] for n in names])[:-1]
    parts = dict(zip(names, np.split(corners[used], widths, axis=1), strict=True))
    return {**parts, "triangles": index.reshape(-1, 3)}


def _half_space(polygon: NDArray[np.float64], side: NDArray[np.float64]) -> NDArray[np.float64]:
    """Part of `polygon` (k, n) where `side` (k,), affine over it, is not negative."""
    rows = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if side[i] >= 0:
            rows.append(polygon[i])
        if side[i] * side[j] < 0:
            t = side[i] / (side[i] - side[j])
            rows.append(polygon[i] + t * (polygon[j] - polygon[i]))
    return np.array(rows).reshape(-1, polygon.shape[1])


def painted(arrays: Arrays, material: Material, light: shading.Light) -> NDArray[np.float32]:
    """Linear colours (n, 4) of corners, light included."""
    color = arrays["color"] / 65535.0
    if not material.unlit:
        normal = arrays["normal"][:, :3]
        length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        color[:, :3] *= shading.irradiance(light, normal / length)
    return color.astype(np.float32)
