"""`farfield worker`: take cells of a farm and bake them."""

from __future__ import annotations

import socket

import click
from farfield_core.errors import BadInputError, NotFoundError
from farfield_worker.farm.celery_app import answering_workers, create_worker, run_worker

from farfield.options import jobs_option, store_option


@click.command("worker")
@store_option
@click.option(
    "--broker", envvar="FARFIELD_BROKER", default="", help="The farm's Redis: redis://host:port/0."
)
@jobs_option
@click.option("--ping", is_flag=True, help="Ask whether this machine's worker answers, and exit.")
def command(store: str, broker: str, jobs: int | None, ping: bool) -> None:
    """Bake cells and prepare scenes for a farm until told to stop."""
    if not broker:
        raise BadInputError("A worker needs its farm's Redis; give --broker redis://host:port/0.")
    if ping:
        if not answering_workers(broker, socket.gethostname()):
            raise NotFoundError("No worker on this machine answers.")
        return
    run_worker(create_worker(broker, store), jobs)
