"""`farfield export`: a walk as plain files, for any static host."""

from __future__ import annotations

import json
from pathlib import Path

import click
from farfield_api.packed import SUFFIXES, pack
from farfield_core.errors import BadInputError
from farfield_core.export import export_folder, export_zip
from farfield_core.store import Store

from farfield.options import json_option, store_option
from farfield.progress import CellProgress


@click.command("export")
@click.argument("bake", required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="New folder; a name that ends in .zip means one zip.",
)
@click.option("--packed/--plain", default=True, help="Also write .br and .gz beside JSON.")
@store_option
@json_option
def command(bake: str | None, out: Path, packed: bool, store: str, as_json: bool) -> None:
    """Write the walk of BAKE; it may be left out where the store holds one bake."""
    opened = Store.open(store, create=False)
    if bake is None:
        bakes = opened.folders("bakes/")
        if len(bakes) != 1:
            raise BadInputError(f"The store holds {len(bakes)} bakes; say which one to export.")
        bake = bakes[0]
    progress = CellProgress(0, 0, "exporting")

    def tell(done: int, total: int) -> None:
        progress.update(done, total)

    with progress:
        if out.suffix == ".zip":
            size = export_zip(opened, bake, out, tell)
        else:
            forms = {
                SUFFIXES["br"]: lambda data: pack(data, "br"),
                SUFFIXES["gzip"]: lambda data: pack(data, "gzip"),
            }
            size = export_folder(opened, bake, out, forms if packed else {}, tell)
    if as_json:
        click.echo(json.dumps({"bake": bake, "out": str(out), "bytes": size}))
    else:
        click.echo(str(out))
