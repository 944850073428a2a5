"""`farfield watch`: follow a bake of a server until it has ended."""

from __future__ import annotations

import json

import click
from farfield_core.errors import BakeFailedError

from farfield.client import Client
from farfield.options import json_option, server_options
from farfield.progress import CellProgress, console


@click.command("watch")
@click.argument("bake")
@server_options
@json_option
def command(bake: str, server: str, key: str, as_json: bool) -> None:
    """Follow BAKE until it has ended; the exit code tells how."""
    with Client(server, key) as client:
        now = client.bake_status(bake)
        progress = CellProgress(now.cells.total, now.cells.done)
        with progress:
            for now in client.watch(bake):
                progress.update(now.cells.done)
        if as_json:
            click.echo(json.dumps(now.model_dump()))
        for failure in now.failures[:20]:
            console().print(f"cell {failure.cell}: {failure.reason}")
        if now.state == "failed":
            raise BakeFailedError(
                f"{now.cells.failed} cells of bake {bake} could not be baked"
                + (f": {now.reason}" if now.reason else ".")
            )
        if not as_json:
            click.echo(client.walk_address(bake))
