"""Objects of which a scene has many copies, each baked once as a true impostor."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from farfield_core.scene import PreparedScene, Repeats

from farfield_worker.objects.document import describe, picture
from farfield_worker.objects.error import OutlineError, measure
from farfield_worker.objects.fields import Fields, bake_fields
from farfield_worker.objects.mesh import ObjectMesh, read_mesh

if TYPE_CHECKING:  # preparing imports this module
    from farfield_worker.prepare.repeats import Copies

#: texels across a height field, the first that is good enough, and height textures
RESOLUTIONS, TEXTURES = (192, 96), 2
#: directions that errors are measured from, and steps of a ray as in a walk (CopyMeshes)
DIRECTIONS, STEPS_PER_PIXEL = 12, 1.5
#: an object that is farther off than this stays polygons
MOST_SILHOUETTE, MOST_HOLES = 0.03, 0.01
#: pixels across the pictures of a first look, and how many times too far off is given up there
COARSE, HOPELESS = 64, 3.0


def bake_shapes(scene: PreparedScene, copies: Copies) -> None:
    """Write objects/ and repeats.json beside the arrays of `scene`, whose owners.npy is written."""
    owners = np.load(scene.folder / "owners.npy", mmap_mode="r").reshape(-1)
    folder = scene.folder / "objects"
    folder.mkdir()
    shapes: list[str] = []
    number = np.full(len(copies.first), -1, np.int64)
    for n, first in enumerate(copies.first.tolist()):
        rows = np.flatnonzero(owners == first)
        mesh = read_mesh(scene, rows, copies.places[first, :3])
        baked = bake_shape(mesh)
        if baked is None:
            continue
        fields, error = baked
        number[n] = len(shapes)
        image = _put(folder, picture(fields), ".png")
        text = describe(mesh, fields, error, f"object {n}", image).model_dump_json()
        shapes.append(_put(folder, text.encode(), ".json"))
    repeats = Repeats(
        shapes=tuple(shapes),
        shape=tuple(number[copies.shape].tolist()),
        places=tuple((x, y, z, s) for x, y, z, s in copies.places.tolist()),
        turns=tuple((x, y, z, w) for x, y, z, w in copies.turns.tolist()),
    )
    (scene.folder / "repeats.json").write_text(repeats.model_dump_json(), encoding="utf-8")


def bake_shape(mesh: ObjectMesh) -> tuple[Fields, OutlineError] | None:
    """The object as height fields, as finely as possible; None if none do it justice."""
    coarse = bake_fields(mesh, RESOLUTIONS[-1], TEXTURES)
    if not _is_good(measure(coarse, mesh, COARSE, 4, STEPS_PER_PIXEL), HOPELESS):
        return None
    for resolution in RESOLUTIONS:
        fields = bake_fields(mesh, resolution, TEXTURES)
        error = measure(fields, mesh, resolution, DIRECTIONS, STEPS_PER_PIXEL)
        if _is_good(error):
            return fields, error
    return None


def _is_good(error: OutlineError, times: float = 1.0) -> bool:
    return error.silhouette <= times * MOST_SILHOUETTE and error.holes <= times * MOST_HOLES


def _put(folder: Path, data: bytes, suffix: str) -> str:
    name = hashlib.sha256(data).hexdigest()[:32] + suffix
    (folder / name).write_bytes(data)
    return name
