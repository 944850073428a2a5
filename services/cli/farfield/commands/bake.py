"""`farfield bake`: a corridor through a scene, into a store. Run again to resume."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from farfield_core.bake import create_bake
from farfield_core.corridor import read_corridor
from farfield_core.errors import BakeFailedError
from farfield_core.settings import BakeSettings
from farfield_core.store import Store

from farfield.baking import bake_all
from farfield.options import (
    corridor_option,
    jobs_option,
    json_option,
    print_json,
    settings_options,
)
from farfield.target import prepared_scene


@click.command("bake")
@click.argument("scene")
@corridor_option
@click.option("--out", required=True, help="Store to bake into: a folder or s3://bucket/prefix.")
@click.option(
    "--follows",
    metavar="BAKE",
    help="A bake of the scene before an edit: cells are reused where the edit cannot be seen.",
)
@settings_options()
@jobs_option
@json_option
def command(
    scene: str,
    corridor: Path,
    out: str,
    follows: str | None,
    settings: BakeSettings,
    jobs: int | None,
    as_json: bool,
) -> None:
    """Bake a corridor through SCENE into a store; run again to bake what is missing.

    SCENE is a model file or the id of a scene in the store.
    """
    wanted = read_corridor(corridor)
    settings.place()  # complain before anything is prepared
    store = Store.open(out)
    info = prepared_scene(store, scene)
    walk = create_bake(store, info, wanted, settings, follows=follows)
    outcome = bake_all(store, walk, jobs)
    if as_json:
        print_json(outcome.figures)
    else:
        click.echo(_sentence(out, outcome.figures))
    if outcome.status.failed or outcome.status.reason:
        raise BakeFailedError(outcome.complaint())


def _sentence(out: str, figures: dict[str, Any]) -> str:
    return (
        f"Bake {figures['bake']} in {out}: {figures['cells']} cells, "
        f"{figures['seconds_per_cell']:.2f} s, {figures['quads']:.0f} quads and "
        f"{figures['atlas_bytes'] / 1e3:.0f} KB a cell."
    )
