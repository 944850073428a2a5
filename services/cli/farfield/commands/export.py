"""`farfield export`: a walk as plain files, for any static host; or one of its cells as glTF."""

from __future__ import annotations

import json
import posixpath
from pathlib import Path

import click
from farfield_api.packed import SUFFIXES, pack
from farfield_core import layout
from farfield_core.cells import Index
from farfield_core.errors import AlreadyExistsError, BadInputError, NotFoundError
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
    help="New folder; a name that ends in .zip means one zip. With --gltf, a new .glb file.",
)
@click.option(
    "--gltf",
    metavar="I,J,K",
    help="Write this one cell as a glTF model, as any glTF viewer shows it.",
)
@click.option(
    "--packed/--plain", default=True, help="Also write .br and .gz beside JSON and near blocks."
)
@store_option
@json_option
def command(
    bake: str | None, out: Path, gltf: str | None, packed: bool, store: str, as_json: bool
) -> None:
    """Write the walk of BAKE; it may be left out where the store holds one bake."""
    opened = Store.open(store, create=False)
    if bake is None:
        bakes = opened.folders("bakes/")
        if len(bakes) != 1:
            raise BadInputError(f"The store holds {len(bakes)} bakes; say which one to export.")
        bake = bakes[0]
    if gltf is not None:
        size = _export_gltf(opened, bake, _index(gltf), out)
        if as_json:
            click.echo(json.dumps({"bake": bake, "out": str(out), "bytes": size}))
        else:
            click.echo(str(out))
        return
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


def _index(text: str) -> Index:
    """A cell's index from "i,j,k"; raises BadInputError."""
    try:
        i, j, k = (int(word) for word in text.split(","))
    except ValueError:
        raise BadInputError(f"{text} names no cell; give three whole numbers: 0,0,0.") from None
    return i, j, k


def _export_gltf(store: Store, bake: str, cell: Index, out: Path) -> int:
    """Write one cell as a GLB; returns its bytes. Raises FarfieldError, nothing then written."""
    from farfield_worker.gltf.cell import cell_glb  # noqa: PLC0415 - brings GL with it
    from farfield_worker.shoot.walk_files import WalkFiles  # noqa: PLC0415

    if out.suffix != ".glb":
        raise BadInputError(f"A glTF model is one .glb file; {out} does not end in .glb.")
    if out.exists():
        raise AlreadyExistsError(f"{out} exists; choose a new name.")

    def read(name: str) -> bytes:
        return store.get(posixpath.normpath(f"{layout.bake_prefix(bake)}{name}"))

    files = WalkFiles(read)
    try:
        found = files.cell(cell)
    except NotFoundError:
        raise NotFoundError(
            f"Cell {','.join(map(str, cell))} of {bake} does not exist; name one that is baked."
        ) from None
    data = cell_glb(files, found)
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_name(f".{out.name}.part")
    part.write_bytes(data)
    part.rename(out)
    return len(data)
