"""`farfield bake-object`: a model file becomes a true impostor in two files."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core.errors import NotFoundError
from farfield_core.scene import open_scene
from PIL import Image

from farfield_worker.objects.error import measure
from farfield_worker.objects.fields import Fields, bake_fields
from farfield_worker.objects.mesh import read_mesh

FORMAT = "farfield-object"
VERSION = 1


def bake_object(model: Path, out: Path, resolution: int = 128, textures: int = 1) -> dict[str, Any]:
    """Bake the model file as one object into `out`/object.json and object.png.

    Returns the figures of object.json. Raises FarfieldError subclasses; nothing is written then.
    """
    # Reading models is slow to import.
    from farfield_worker.prepare import prepare  # noqa: PLC0415

    if not model.is_file():
        raise NotFoundError(f"There is no model file {model}.")
    with tempfile.TemporaryDirectory(prefix="farfield-object-") as folder:
        prepared = Path(folder) / "prepared"
        prepare(model, prepared, "object", model.stem)
        mesh = read_mesh(open_scene(prepared))
        fields = bake_fields(mesh, resolution, textures)
        error = measure(fields, mesh)
    figures = {
        "triangles": len(mesh.corners),
        "silhouette": error.silhouette,
        "error": error.metres,
        "closed": fields.closed,
    }
    write(fields, model.stem, figures, out)
    return figures


def write(fields: Fields, name: str, figures: dict[str, Any], out: Path) -> None:
    """Write object.png, and last object.json, into the folder `out`."""
    textures, resolution = fields.heights.shape[:2]
    layers = [*fields.heights]
    for colors, normals in zip(fields.colors, fields.normals, strict=True):
        for layer in (colors, normals):
            opaque = np.full((*layer.shape[:2], 1), 255, np.uint8)
            layers.append(np.concatenate([layer, opaque], axis=2))
    text = {
        "format": FORMAT,
        "version": VERSION,
        "name": name,
        "low": fields.low.tolist(),
        "high": fields.high.tolist(),
        "axes": list(fields.axes),
        "resolution": resolution,
        "textures": textures,
        "image": "object.png",
        **figures,
    }
    out.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.concatenate(layers)).save(out / "object.png", optimize=True)
    part = out / ".object.json.part"
    part.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")
    part.replace(out / "object.json")
