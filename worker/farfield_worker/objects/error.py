"""How far an impostor's outline is from the mesh's: from where on polygons are drawn instead."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_worker.objects.cast import cast_rays
from farfield_worker.objects.columns import cross_columns
from farfield_worker.objects.fields import Fields
from farfield_worker.objects.mesh import Floats, ObjectMesh, opaque_at

#: directions that are looked from, and pixels across each picture
DIRECTIONS, PIXELS = 24, 96
#: steps of the march for each pixel that the box is across, as the viewer's shader takes them
STEPS_PER_PIXEL = 0.75
#: outline farther off than this is counted as this, pixels
FARTHEST = 8

Mask = NDArray[np.bool_]


class OutlineError(NamedTuple):
    """How far apart mesh and impostor are.

    Attributes:
        silhouette: share of outline pixels more than a pixel off.
        metres: 95 % of the outline are nearer.
        holes: share of the mesh's pixels, its outline and the pixels beside it left out, that the
            impostor does not cover.
    """

    silhouette: float
    metres: float
    holes: float


def measure(
    fields: Fields,
    mesh: ObjectMesh,
    pixels: int = PIXELS,
    directions: int = DIRECTIONS,
    steps_per_pixel: float = STEPS_PER_PIXEL,
) -> OutlineError:
    """Compare outlines from directions spread over the sphere, without perspective."""
    steps = round(steps_per_pixel * pixels)
    off: list[NDArray[np.int64]] = []
    inner = missed = 0
    radius = float(np.linalg.norm(fields.high - fields.low)) / 2
    for direction in sphere(directions):
        true, cast = pictures(fields, mesh, direction, pixels, steps)
        off.append(outline_distance(true, cast))
        inside = erode(erode(true))
        inner += int(inside.sum())
        missed += int((inside & ~cast).sum())
    distance = np.concatenate(off)
    if len(distance) == 0:
        return OutlineError(0.0, 0.0, 0.0)
    pixel = 2 * radius / pixels
    return OutlineError(
        float((distance > 1).mean()),
        float(np.quantile(distance, 0.95, method="higher")) * pixel,
        missed / inner if inner else 0.0,
    )


def sphere(count: int) -> Floats:
    """Directions spread evenly (a Fibonacci lattice), (count, 3) unit."""
    n = np.arange(count) + 0.5
    y = 1 - 2 * n / count
    turn = np.pi * (1 + 5**0.5) * n
    r = np.sqrt(1 - y**2)
    return np.stack([r * np.cos(turn), y, r * np.sin(turn)], axis=1)


def pictures(
    fields: Fields, mesh: ObjectMesh, direction: Floats, pixels: int, steps: int
) -> tuple[Mask, Mask]:
    """Where mesh and impostor are seen along `direction`, (pixels, pixels) bool each."""
    side = np.cross(direction, (1.0, 0.0, 0.0) if abs(direction[0]) < 0.7 else (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    basis = np.stack([side, np.cross(direction, side), direction])
    middle = (fields.low + fields.high) / 2
    radius = float(np.linalg.norm(fields.high - fields.low)) / 2
    corners = ((mesh.corners - middle) @ basis.T) / (2 * radius) + 0.5
    crossings = cross_columns(np.ascontiguousarray(corners), pixels)
    hit = opaque_at(mesh, crossings.triangle, crossings.weights)
    column = np.repeat(np.arange(pixels**2), np.diff(crossings.starts))
    true = np.zeros(pixels**2, np.bool_)
    true[column[hit]] = True
    at = (2 * (np.arange(pixels) + 0.5) / pixels - 1) * radius
    x, y = np.meshgrid(at, at)
    origins = middle + x.reshape(-1, 1) * basis[0] + y.reshape(-1, 1) * basis[1]
    origins = origins - 2 * radius * direction
    distance = cast_rays(fields, origins, np.tile(direction, (len(origins), 1)), steps)
    return true.reshape(pixels, pixels), np.isfinite(distance).reshape(pixels, pixels)


def outline(mask: Mask) -> Mask:
    """Pixels of a mask that have one of the eight around them outside it."""
    return mask & ~erode(mask)


def erode(mask: Mask) -> Mask:
    """Pixels of a mask that have all eight around them in it."""
    padded = np.pad(mask, 1)
    inside = np.ones_like(mask)
    for dy in range(3):
        for dx in range(3):
            inside &= padded[dy : dy + mask.shape[0], dx : dx + mask.shape[1]]
    return inside


def outline_distance(true: Mask, other: Mask) -> NDArray[np.int64]:
    """For each outline pixel of `true` how many pixels away the other's outline is, at most 8."""
    wanted, near = outline(true), outline(other)
    distance = np.full(true.shape, FARTHEST, np.int64)
    distance[near] = 0
    for step in range(1, FARTHEST):
        padded = np.pad(near, 1)
        grown = np.zeros_like(near)
        for dy in range(3):
            for dx in range(3):
                grown |= padded[dy : dy + near.shape[0], dx : dx + near.shape[1]]
        distance[grown & ~near] = step
        near = grown
    return distance[wanted]
