"""`farfield bake-object`: a model file becomes a true impostor in two files."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from farfield_core.errors import NotFoundError
from farfield_core.scene import open_scene

from farfield_worker.objects.document import describe, figures_of, picture
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
        prepare(model, prepared, "object", model.stem)
        mesh = read_mesh(open_scene(prepared))
        fields = bake_fields(mesh, resolution, textures)
        error = measure(fields, mesh)
    figures = figures_of(mesh, fields, error)
    write(fields, model.stem, figures, out)
    return figures


def write(fields: Fields, name: str, figures: dict[str, Any], out: Path) -> None:
    """Write object.png, and last object.json, into the folder `out`."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "object.png").write_bytes(picture(fields))
    part = out / ".object.json.part"
    text = json.dumps(describe(fields, name, figures, "object.png"), indent=1)
    part.write_text(text + "\n", encoding="utf-8")
    part.replace(out / "object.json")
