"""A true impostor as files: object.json and its picture (docs/format.md, "Object files")."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image

from farfield_worker.objects.error import OutlineError
from farfield_worker.objects.fields import Fields
from farfield_worker.objects.mesh import ObjectMesh

FORMAT = "farfield-object"
VERSION = 1


def figures_of(mesh: ObjectMesh, fields: Fields, error: OutlineError) -> dict[str, Any]:
    """What object.json says about its quality."""
    return {
        "triangles": len(mesh.corners),
        "silhouette": error.silhouette,
        "error": error.metres,
        "holes": error.holes,
        "closed": fields.closed,
    }


def describe(fields: Fields, name: str, figures: dict[str, Any], image: str) -> dict[str, Any]:
    """object.json; `image` is its picture's name."""
    textures, resolution = fields.heights.shape[:2]
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": name,
        "low": fields.low.tolist(),
        "high": fields.high.tolist(),
        "axes": list(fields.axes),
        "resolution": resolution,
        "textures": textures,
        "image": image,
        **figures,
    }


def picture(fields: Fields) -> bytes:
    """All layers one below the other as a PNG: heights, then colour and normal of each height."""
    layers = [*fields.heights]
    for colors, normals in zip(fields.colors, fields.normals, strict=True):
        for layer in (colors, normals):
            opaque = np.full((*layer.shape[:2], 1), 255, np.uint8)
            layers.append(np.concatenate([layer, opaque], axis=2))
    out = io.BytesIO()
    Image.fromarray(np.concatenate(layers)).save(out, "PNG", optimize=True)
    return out.getvalue()
