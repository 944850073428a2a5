"""`farfield worker`: take cells of a farm and bake them."""

from __future__ import annotations

import os
import socket

import click
from farfield_core.dispatch.prepare import PrepareLimits
from farfield_core.dispatch.queues import Device
from farfield_core.errors import BadInputError, FarfieldError, NotFoundError
from farfield_worker.farm.bakers import Limits
from farfield_worker.farm.celery_app import answering_workers, create_worker, run_worker
from farfield_worker.probe import probe

from farfield.options import jobs_option, store_option


@click.command("worker")
@store_option
@click.option(
    "--broker", envvar="FARFIELD_BROKER", default="", help="The farm's Redis: redis://host:port/0."
)
@jobs_option
@click.option(
    "--device",
    type=click.Choice(["cpu", "gpu"]),
    envvar="FARFIELD_DEVICE",
    default="cpu",
    show_default=True,
    help="Cells to take: those for GPUs are refused where software draws.",
)
@click.option("--ping", is_flag=True, help="Ask whether this machine's worker answers, and exit.")
def command(store: str, broker: str, jobs: int | None, device: Device, ping: bool) -> None:
    """Bake cells and prepare scenes for a farm until told to stop."""
    if not broker:
        raise BadInputError("A worker needs its farm's Redis; give --broker redis://host:port/0.")
    if ping:
        if not answering_workers(broker, socket.gethostname()):
            raise NotFoundError("No worker on this machine answers.")
        return
    processes = jobs or os.cpu_count() or 1
    limits = Limits.from_environment(os.environ, processes)
    _say_what_draws(device)
    preparing = PrepareLimits.from_environment(os.environ)
    app = create_worker(broker, store, device=device, limits=limits, prepare_limits=preparing)
    run_worker(app, processes, device)


def _say_what_draws(device: Device) -> None:
    """Print what draws here; raises FarfieldError where that is not what `device` asks for."""
    try:
        renderer = probe()
    except FarfieldError as error:
        if device == "gpu":
            raise
        # it can still prepare scenes, and sets itself aside when it cannot bake
        click.echo(str(error), err=True)
        return
    click.echo(f"Cells are drawn by {renderer.name}.", err=True)
    if device == "gpu" and renderer.software:
        raise FarfieldError(
            f"A worker with --device gpu needs a GPU, but {renderer.name} draws in software; "
            "see docs/deploy.md, or use --device cpu."
        )
