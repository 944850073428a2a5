"""`farfield shoot`: one picture of a scene or a walk."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click
from farfield_core import scenes
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store
from farfield_worker.shoot.command import shoot_to_file
from farfield_worker.shoot.view import View

from farfield.options import store_option


def _numbers(option: str, text: str, count: int) -> list[float]:
    """Numbers separated by commas; raises BadInputError."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise BadInputError(f"{option} {text} cannot be read; give {count} numbers with commas.")
    return numbers


@click.command("shoot")
@click.argument("target")
@click.option("--eye", required=True, metavar="X,Y,Z", help="Where the eye is, metres.")
@click.option(
    "--look",
    required=True,
    metavar="YAW,PITCH",
    help="Where it looks, radians: yaw 0 along -z, turning left; pitch upwards.",
)
@click.option("--fov", default=60.0, show_default=True, help="Angle of view, degrees.")
@click.option("--size", default=512, show_default=True, help="Pixels across.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="PNG file to write.")
@store_option
def command(target: str, eye: str, look: str, fov: float, size: int, out: Path, store: str) -> None:
    """Draw one picture of TARGET.

    TARGET is a walk (a store with one bake, a bake's folder or its walk.json), drawn from its files
    alone, or a scene (a model file, a prepared folder, or the id of a scene in the store), drawn in
    full.
    """
    x, y, z = _numbers("--eye", eye, 3)
    yaw, pitch = _numbers("--look", look, 2)
    view = View(eye=(x, y, z), yaw=yaw, pitch=pitch, fov=fov, size=size)
    if Path(target).exists():
        shoot_to_file(Path(target), view, out)
        return
    try:
        opened = Store.open(store, create=False)
        with tempfile.TemporaryDirectory(prefix="farfield-") as folder:
            shoot_to_file(scenes.prepared_folder(opened, target, Path(folder)), view, out)
    except NotFoundError:
        raise NotFoundError(
            f"There is no file or folder {target}, and no such scene in the store {store}."
        ) from None
