"""`farfield demo`: bake a corridor and open the walk while it bakes."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import time
from pathlib import Path

import click
from farfield_api.app import create_app, create_service
from farfield_api.service import FarfieldService
from farfield_api.settings import ApiSettings
from farfield_core import scenes
from farfield_core.bake import read_walk
from farfield_core.corridor import Corridor, read_corridor
from farfield_core.errors import BakeFailedError, NotFoundError
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.suggest import suggest_corridor
from farfield_worker import demo

from farfield.options import jobs_option, port_options, settings_options, store_option
from farfield.progress import CellProgress, console, working
from farfield.server import Server
from farfield.target import prepared_scene


@click.command("demo")
@click.argument("scene", required=False)
@click.option(
    "--corridor",
    type=click.Path(path_type=Path),
    help="Corridor file; a short walk in a good place is chosen unless given.",
)
@click.option(
    "--detail",
    type=click.IntRange(50_000, 10_000_000),
    default=850_000,
    show_default=True,
    help="Triangles of the demo city.",
)
@store_option
@port_options
@settings_options()
@jobs_option
def command(
    scene: str | None,
    corridor: Path | None,
    detail: int,
    store: str,
    host: str,
    port: int,
    settings: BakeSettings,
    jobs: int | None,
) -> None:
    """Bake a corridor through SCENE and open the walk while it bakes.

    SCENE is a model file or the id of a scene in the store; without it the demo city is baked.
    """
    if scene is None and corridor is None:
        corridor = demo.AVENUE
        settings = _with_cells(settings, demo.CELL_SIZE)
    wanted = None if corridor is None else read_corridor(corridor)
    api = ApiSettings.from_environment(os.environ, store=store, jobs=jobs)
    server = Server(host, port)
    service = create_service(api)
    try:
        with server.beside(create_app(api, service)):
            identity = _scene(service.store, scene, detail)
            bake = _begin(service, identity, wanted, settings)
            _watch(service, bake, f"{server.address}/walk/{bake}")
    except KeyboardInterrupt:
        click.echo("Stopped; run the same command again to go on.", err=True)


def _begin(
    service: FarfieldService, identity: str, corridor: Corridor | None, settings: BakeSettings
) -> str:
    """Choose a corridor if need be and have its bake begun; returns the bake's id."""
    if corridor is None:
        with working("Choosing a corridor"), tempfile.TemporaryDirectory() as folder:
            scene = scenes.open_prepared(service.store, identity, Path(folder))
            chosen = suggest_corridor(scene)
        corridor = chosen.corridor
        settings = _with_cells(settings, chosen.cell_size)
    bake = service.create_bake(identity, corridor, settings)
    walk = read_walk(service.store, bake)
    # before whatever else this store still has to bake
    if walk.grid.cells is not None and service.bakes.progress(bake).status.state != "done":
        table = walk.grid.cells
        service.bakes.focus(bake, (table.i[0], table.j[0], table.k[0]))
    return bake


def _with_cells(settings: BakeSettings, edge: float) -> BakeSettings:
    """Settings with cubic cells of this edge, unless they say how large cells are."""
    if "cell_size" in settings.model_fields_set:
        return settings
    given = settings.model_dump(include=settings.model_fields_set)
    return BakeSettings(**given, cell_size=(edge, edge, edge))


def _scene(store: Store, scene: str | None, detail: int) -> str:
    """A prepared scene's id: the one asked for, or the demo city, built once for each store."""
    if scene is not None:
        return prepared_scene(store, scene).id
    key = f"demo/city-{detail}-{_city_version()}.json"
    try:
        city = str(json.loads(store.get(key))["scene"])
        return scenes.scene_info(store, city).id
    except NotFoundError:
        pass
    from farfield_worker.demo.city import write_city  # noqa: PLC0415 - slow to import

    with tempfile.TemporaryDirectory(prefix="farfield-") as folder:
        model = Path(folder) / "Lake city.glb"
        with working("Building the demo city"):
            write_city(model, detail)
        city = prepared_scene(store, str(model)).id
    store.put(key, json.dumps({"scene": city}).encode())
    return city


def _city_version() -> str:
    """Hash of the code that builds the demo city."""
    digest = hashlib.sha256()
    for file in sorted(Path(demo.__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _watch(service: FarfieldService, bake: str, address: str) -> None:
    """Say when the first cell can be walked, then follow the bake until interrupted."""
    total = read_walk(service.store, bake).grid.total
    with working("Baking the first cell"):
        while not (done := service.bakes.done_since(bake, 0)):
            _complain(service, bake)
            time.sleep(0.05)
    click.echo(f"walk ready: {address}")
    if len(done) < total:
        with CellProgress(total, len(done)) as progress:
            while len(done) < total:
                more = service.bakes.done_since(bake, len(done))
                done += more
                for _ in more:
                    progress.one_more()
                if not more:
                    _complain(service, bake)
                    time.sleep(0.2)
    console().print(f"All {total} cells are baked. Ctrl-C ends the server.")
    while True:
        time.sleep(3600)


def _complain(service: FarfieldService, bake: str) -> None:
    """Raise BakeFailedError if the bake has failed."""
    status = service.bakes.progress(bake).status
    if status.state == "failed":
        reason = status.reason or next(iter(status.reasons.values()), "no reason was given")
        raise BakeFailedError(f"{status.failed} cells could not be baked: {reason}")
