"""Prepared scenes in memory, made of loose triangles."""

from pathlib import Path

import numpy as np
from farfield_core.scene import Block, Bounds, Part, PreparedScene, SceneInfo
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def soup(
    corners: Floats, origin: tuple[float, float, float] = (0, 0, 0), blocks: int = 3
) -> PreparedScene:
    """A prepared scene of triangles `corners` (n, 3, 3), scene coordinates, in a few blocks."""
    count = len(corners)
    local = (corners - np.array(origin)).astype(np.float32)
    table = []
    for rows in np.array_split(np.arange(count), min(blocks, count)):
        some = local[rows].reshape(-1, 3)
        low, high = (tuple(float(n) for n in v) for v in (some.min(axis=0), some.max(axis=0)))
        part = Part(batch=0, first_triangle=int(rows[0]), triangles=len(rows))
        table.append(
            Block(
                low=(low[0], low[1], low[2]),
                high=(high[0], high[1], high[2]),
                first_vertex=3 * int(rows[0]),
                vertices=3 * len(rows),
                parts=(part,),
            )
        )
    low, high = (
        (float(v[0]), float(v[1]), float(v[2]))
        for v in (corners.min(axis=(0, 1)), corners.max(axis=(0, 1)))
    )
    info = SceneInfo(
        id="50f7500000000000",
        name="soup",
        bounds=Bounds(min=low, max=high),
        origin=origin,
        triangles=count,
        vertices=3 * count,
        textures=(),
        batches=(),
        blocks=tuple(table),
    )
    return PreparedScene(
        folder=Path("/nowhere"),
        info=info,
        positions=local.reshape(-1, 3),
        normals=np.zeros((3 * count, 4), np.int8),
        uvs=np.zeros((3 * count, 2), np.float32),
        colors=np.zeros((3 * count, 4), np.uint16),
        triangles=np.arange(3 * count, dtype=np.uint32).reshape(-1, 3),
    )


def floor(low: tuple[float, float], high: tuple[float, float], y: float) -> Floats:
    """A level rectangle that faces up, (2, 3, 3)."""
    (x0, z0), (x1, z1) = low, high
    a, b, c, d = (x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0)
    return np.array([[a, b, c], [a, c, d]], np.float64)


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Floats:
    """A closed box that faces outwards, (12, 3, 3)."""
    corners = np.array([[(low, high)[n >> axis & 1][axis] for axis in range(3)] for n in range(8)])
    sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    triangles = []
    for a, b, c, d in sides:
        triangles += [corners[[a, b, c]], corners[[a, c, d]]]
    faces = np.array(triangles, np.float64)
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    outwards = ((faces.mean(axis=1) - corners.mean(axis=0)) * normal).sum(axis=1) > 0
    faces[~outwards] = faces[~outwards][:, ::-1]
    return faces
