"""`farfield plan`: what a bake will come to."""

from __future__ import annotations

from pathlib import Path

import click
from farfield_core.choice import choose
from farfield_core.corridor import read_corridor
from farfield_core.settings import BakeSettings

from farfield.options import (
    corridor_option,
    json_option,
    print_json,
    settings_options,
    store_option,
)
from farfield.target import borrowed_scene


@click.command("plan")
@click.argument("scene")
@corridor_option
@store_option
@settings_options()
@json_option
def command(scene: str, corridor: Path, store: str, settings: BakeSettings, as_json: bool) -> None:
    """What baking a corridor through SCENE will come to; renders nothing.

    SCENE is a model file or the id of a scene in the store.
    """
    wanted = read_corridor(corridor)
    with borrowed_scene(store, scene) as (_, info):
        result = choose(info, wanted, settings).plan
    if as_json:
        print_json(result.model_dump())
        return
    if result.why:
        click.echo(result.why)
    click.echo(f"cells        {result.cells}")
    click.echo(f"cell size    {' x '.join(f'{edge:.4g}' for edge in result.cell_size)} m")
    click.echo(f"near field   {result.near_field:.2f} m")
    click.echo(f"layers       {result.layers}")
    click.echo("Estimates for a cell (in brackets: with nothing hidden left out):")
    for name, unit in (
        ("near_triangles", ""),
        ("most_near_triangles", ""),
        ("quads", ""),
        ("texels", ""),
        ("kilobytes", " kB"),
    ):
        title = name.replace("_", " ")
        value, before = getattr(result, name), result.before[name]
        click.echo(f"{title:20} {value:.0f}{unit} ({before:.0f}{unit})")
    click.echo("Estimates for the bake:")
    click.echo(f"files        {result.megabytes:.1f} MB")
    click.echo(f"time         {result.seconds:.0f} s of one process")
