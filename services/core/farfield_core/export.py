"""A walk as plain files that any static host serves, in a folder or in one zip.

    walk.json, pages/, cells/, atlases/, near/      the walk, its places relative to itself
    *.json.br, *.json.gz, *.glb.br, *.glb.gz        compressed forms, where asked for

In a zip, JSON and near blocks are deflated and pictures, compressed already, are stored, so that a
reader with range requests gets a cell in one request; entries have no date, so the same walk is the
same zip.
"""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

from farfield_core import layout
from farfield_core.bake import done_cells, read_walk, relocate
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store
from farfield_core.validation import parse
from farfield_core.walk import CellFile, Places

PLACES = Places(cells="cells/", atlases="atlases/", near="near/")

#: what is compressed; pictures are already
_LOOSE = (".json", ".glb")

Progress = Callable[[int, int], None]


def export_folder(
    store: Store, bake: str, folder: Path, pack: dict[str, Callable[[bytes], bytes]], tell: Progress
) -> int:
    """Write a walk into a new folder; returns its bytes.

    `pack` makes compressed forms by suffix. Raises BadInputError if there is something in
    the folder, and NotFoundError for no such bake.
    """
    if folder.exists() and any(folder.iterdir()):
        raise BadInputError(f"{folder} is not empty; export into a new folder.")
    total = 0
    for name, data in _files(store, bake, tell):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        total += len(data)
        if name.endswith(_LOOSE):
            for suffix, packed in pack.items():
                path.with_name(path.name + suffix).write_bytes(packed(data))
    return total


def export_zip(store: Store, bake: str, target: Path, tell: Progress) -> int:
    """Write a walk as one zip; returns its bytes. Raises as `export_folder`."""
    if target.exists():
        raise BadInputError(f"{target} is there already; export into a new file.")
    part = target.with_name(target.name + ".part")
    try:
        with zipfile.ZipFile(part, "w") as archive:
            for name, data in _files(store, bake, tell):
                entry = zipfile.ZipInfo(name)
                entry.external_attr = 0o644 << 16
                loose = name.endswith(_LOOSE)
                entry.compress_type = zipfile.ZIP_DEFLATED if loose else zipfile.ZIP_STORED
                archive.writestr(entry, data, compresslevel=6 if loose else None)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    return target.stat().st_size


def _files(store: Store, bake: str, tell: Progress) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of a walk's files, the manifest last."""
    try:
        walk = read_walk(store, bake)
    except NotFoundError:
        raise NotFoundError(f"There is no bake {bake} in the store.") from None
    cells = sorted(done_cells(store, bake))
    if not cells:
        raise BadInputError(f"No cell of bake {bake} is baked yet; there is nothing to export.")
    for page in walk.grid.pages:
        yield page.href, store.get(layout.bake_prefix(bake) + page.href)
    known: set[str] = set()
    for number, index in enumerate(cells):
        key = layout.cell_key(bake, index)
        data = store.get(key)
        cell = parse(CellFile, data, f"The cell {key}")
        blobs = {f"atlases/{name}": layout.atlas_key(name) for name in cell.atlases}
        blobs |= {f"near/{part.blob}": layout.near_key(part.blob) for part in cell.near}
        for name, place in blobs.items():
            if name not in known:
                known.add(name)
                content = store.get(place)
                yield name, content
                waiting = siblings(name, content)
                while waiting:
                    sibling = waiting.pop()
                    if f"near/{sibling}" not in known:
                        known.add(f"near/{sibling}")
                        beside = store.get(layout.near_key(sibling))
                        yield f"near/{sibling}", beside
                        waiting += siblings(sibling, beside)
        yield f"cells/{key.rsplit('/', 1)[1]}", data
        tell(number + 1, len(cells))
    yield "walk.json", relocate(walk, PLACES).model_dump_json().encode()


def siblings(name: str, content: bytes) -> list[str]:
    """Names of the files that a near block, or an object of one, has beside it (docs/format.md)."""
    if name.endswith(".json"):
        return [str(json.loads(content)["image"])]
    if not name.endswith(".glb"):
        return []
    (length,) = struct.unpack_from("<I", content, 12)
    root = json.loads(content[20 : 20 + length])
    textures = [str(image["uri"]) for image in root.get("images", []) if "uri" in image]
    objects = root.get("extras", {}).get("objects", {})
    return textures + [str(shape) for shape in objects.get("shapes", [])]
