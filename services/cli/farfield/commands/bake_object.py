"""`farfield bake-object`: a true impostor of one model."""

from __future__ import annotations

from pathlib import Path

import click

from farfield.options import json_option, print_json


@click.command("bake-object")
@click.argument("model", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write.")
@click.option(
    "--resolution",
    default=128,
    show_default=True,
    type=click.IntRange(16, 255),
    help="Texels across a height field.",
)
@click.option(
    "--textures",
    default=1,
    show_default=True,
    type=click.IntRange(1, 8),
    help="Height textures, two slabs each; more for deeper shapes.",
)
@json_option
def command(model: Path, out: Path, resolution: int, textures: int, as_json: bool) -> None:
    """Bake the object in the file MODEL into height fields that the viewer casts rays into."""
    from farfield_worker.objects.command import bake_object  # noqa: PLC0415

    figures = bake_object(model, out, resolution, textures)
    if as_json:
        print_json(figures)
        return
    click.echo(
        f"{figures['triangles']} triangles; {100 * figures['silhouette']:.1f} % of the outline is "
        f"more than a pixel off, 95 % of it within {figures['error']:.3g} m."
    )
