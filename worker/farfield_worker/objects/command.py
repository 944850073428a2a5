"""`farfield bake-object`: a model file becomes a true impostor in two files."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from farfield_core.errors import NotFoundError
from farfield_core.object_file import ObjectFile
from farfield_core.scene import open_scene

from farfield_worker.objects.document import describe, picture
from farfield_worker.objects.error import measure
from farfield_worker.objects.fields import Fields, bake_fields
from farfield_worker.objects.mesh import read_mesh


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
        prepare(model, prepared, "object", model.stem, pictures=False, repeats=False)
        mesh = read_mesh(open_scene(prepared))
        fields = bake_fields(mesh, resolution, textures)
        error = measure(fields, mesh)
    file = describe(mesh, fields, error, model.stem, "object.png")
    write(fields, file, out)
    names = ("triangles", "silhouette", "error", "holes", "closed")
    return {name: getattr(file, name) for name in names}


def write(fields: Fields, file: ObjectFile, out: Path) -> None:
    """Write the picture, and last object.json, into the folder `out`."""
    out.mkdir(parents=True, exist_ok=True)
    (out / file.image).write_bytes(picture(fields))
    part = out / ".object.json.part"
    part.write_text(file.model_dump_json(indent=1) + "\n", encoding="utf-8")
    part.replace(out / "object.json")
