"""`farfield bakes`: the bakes of a server."""

from __future__ import annotations

import json

import click

from farfield.client import Client
from farfield.options import json_option, server_options


@click.command("bakes")
@click.option("--state", help="Only bakes in this state.")
@server_options
@json_option
def command(state: str | None, server: str, key: str, as_json: bool) -> None:
    """List the bakes of a server, the newest first."""
    with Client(server, key) as client:
        found = list(client.bakes(**({"state": state} if state else {})))
    if as_json:
        click.echo(json.dumps({"bakes": [bake.model_dump() for bake in found]}))
        return
    for bake in found:
        cells = f"{bake.cells.done}/{bake.cells.total}"
        failed = f", {bake.cells.failed} failed" if bake.cells.failed else ""
        click.echo(f"{bake.id}  {bake.state:9}  {cells:>11} cells{failed}  {bake.name}")
