"""A true impostor as files: object.json and its picture (docs/format.md, "Object files")."""

from __future__ import annotations

import numpy as np
from farfield_core.object_file import ObjectFile

from farfield_worker.compile.encode import png
from farfield_worker.objects.error import OutlineError
from farfield_worker.objects.fields import Fields
from farfield_worker.objects.mesh import ObjectMesh


def describe(
    mesh: ObjectMesh, fields: Fields, error: OutlineError, name: str, image: str
) -> ObjectFile:
    """object.json; `image` is its picture's name."""
    textures, resolution = fields.heights.shape[:2]
    x, y, z = fields.low.tolist()
    to_x, to_y, to_z = fields.high.tolist()
    return ObjectFile(
        name=name,
        low=(x, y, z),
        high=(to_x, to_y, to_z),
        axes=fields.axes,
        resolution=resolution,
        textures=textures,
        image=image,
        triangles=len(mesh.corners),
        silhouette=error.silhouette,
        error=error.metres,
        holes=error.holes,
        closed=fields.closed,
    )


def picture(fields: Fields) -> bytes:
    """All layers one below the other as a PNG: heights, then colour and normal of each height."""
    layers = [*fields.heights]
    for colors, normals in zip(fields.colors, fields.normals, strict=True):
        for layer in (colors, normals):
            opaque = np.full((*layer.shape[:2], 1), 255, np.uint8)
            layers.append(np.concatenate([layer, opaque], axis=2))
    return png(np.concatenate(layers))
