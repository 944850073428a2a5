"""`farfield shoot`: one picture of whatever a path names."""

from __future__ import annotations

import tempfile
from pathlib import Path

from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.scene import open_scene
from PIL import Image

from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import Picture, View
from farfield_worker.shoot.walk import WalkShooter


def shoot_to_file(target: Path, view: View, out: Path) -> None:
    """Draw `target` and write an RGBA PNG, alpha 0 where background shows.

    `target` is a walk (its walk.json, the folder of it, or a store that holds one bake), a prepared
    scene's folder, or a model file, which is prepared into a temporary folder first.
    Raises FarfieldError subclasses.
    """
    if out.suffix.lower() != ".png":
        raise BadInputError(f"The picture {out} must be a PNG; use a name that ends in .png.")
    if not target.exists():
        raise NotFoundError(f"There is no file or folder {target}.")
    picture = shoot(target, view)
    part = out.with_name(f".{out.name}.part")
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        Image.fromarray(picture.rgba).save(part, format="PNG")
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)


def shoot(target: Path, view: View) -> Picture:
    """Draw what `target` names; see `shoot_to_file`."""
    if target.is_dir() and (target / "scene.json").is_file():
        return _shoot_scene(target, view)
    if target.is_dir() or target.suffix.lower() == ".json":
        shooter = WalkShooter(target)
        try:
            return shooter.shoot(view)
        finally:
            shooter.close()
    # Reading models is not needed for anything else here, and slow to import.
    from farfield_worker.prepare import prepare  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="farfield-shoot-") as folder:
        prepared = Path(folder) / "prepared"
        prepare(target, prepared, "shoot", target.stem)
        return _shoot_scene(prepared, view)


def _shoot_scene(folder: Path, view: View) -> Picture:
    shooter = SceneShooter(open_scene(folder))
    try:
        return shooter.shoot(view)
    finally:
        shooter.close()
