"""`farfield serve`: the API, the pages and embedded baking."""

from __future__ import annotations

import os

import click
from farfield_api.app import create_app
from farfield_api.observe import log_to_stderr
from farfield_api.settings import ApiSettings

from farfield.options import jobs_option, port_options, store_option
from farfield.server import Server


@click.command("serve")
@store_option
@port_options
@jobs_option
def command(store: str, host: str, port: int, jobs: int | None) -> None:
    """Serve the API, the pages and baking; everything else is set by FARFIELD_* variables."""
    settings = ApiSettings.from_environment(os.environ, store=store, jobs=jobs, host=host)
    log_to_stderr(settings.logs)
    server = Server(host, port)
    click.echo(f"Farfield serves {settings.store} at {server.address}", err=True)
    server.run(create_app(settings))
