"""`farfield layers`: where layers and borders lie."""

from __future__ import annotations

import click
from farfield_core.settings import BakeSettings

from farfield.options import json_option, print_json, settings_options


@click.command("layers")
@settings_options("cell_size", "resolution", "layers", "near", "alpha", "gap_texels")
@json_option
def command(settings: BakeSettings, as_json: bool) -> None:
    """Where the layers and borders of a view cell lie, metres from its centre, far to near."""
    placement = settings.place()
    if as_json:
        print_json(
            {
                "layers": placement.layers,
                "borders": placement.borders,
                "near_field": placement.near_field,
            }
        )
        return
    click.echo("layer    distance      border behind it on the near side")
    for n, (layer, border) in enumerate(zip(placement.layers, placement.borders, strict=True)):
        click.echo(f"{n:5d} {layer:11.3f} {border:11.3f}")
    click.echo(f"The near field reaches {placement.near_field:.2f} m from the cell's centre.")
