"""`farfield upload`: send a model to a server and wait until it is ready."""

from __future__ import annotations

import json
from pathlib import Path

import click

from farfield.client import Client
from farfield.options import json_option, server_options
from farfield.progress import bytes_progress, working


@click.command("upload")
@click.argument("model", type=click.Path(path_type=Path))
@click.option("--bake", "bake_it", is_flag=True, help="Bake the walk that the server suggests.")
@server_options
@json_option
def command(model: Path, bake_it: bool, server: str, key: str, as_json: bool) -> None:
    """Send MODEL, or a zip with its textures; it goes on by itself where a connection breaks."""
    with Client(server, key) as client:
        with bytes_progress(model.name) as progress:
            scene = client.upload(model, progress)
        with working("The server prepares it"):
            found = client.wait_scene(scene)
        answer = {"scene": scene, "name": found.name, "triangles": found.triangles}
        if bake_it:
            corridor, cell_size = client.suggestion(scene)
            answer["bake"] = client.bake(scene, corridor, cell_size=cell_size)
            answer["walk"] = client.walk_address(str(answer["bake"]))
        elif not as_json:
            click.echo(f"{client.root}scene/{scene}")
    if as_json:
        click.echo(json.dumps(answer))
    elif bake_it:
        click.echo(answer["walk"])
