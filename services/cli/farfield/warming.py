"""Compile what a first bake would have to wait for, while there is something else to wait for.

The compilers keep their results on disk, so one tiny bake is enough for each version of the code;
a stamp remembers that it was done.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import farfield_worker
from farfield_core import scenes
from farfield_core.bake import create_bake
from farfield_core.corridor import parse_corridor
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.dispatch.prepare import prepare_scene
from farfield_core.errors import FarfieldError
from farfield_core.settings import BakeSettings
from farfield_core.store import Store


@contextmanager
def warming_up() -> Iterator[None]:
    """Warm up beside what is done in the context; whatever goes wrong shows in the real bake."""
    stop = threading.Event()
    stamp = _stamp()
    thread = threading.Thread(target=_warm_up, args=(stamp, stop), name="farfield-warming")
    if not stamp.exists():
        thread.start()
    try:
        yield
    except BaseException:
        stop.set()
        raise
    finally:
        if thread.ident is not None:
            thread.join()


def _warm_up(stamp: Path, stop: threading.Event) -> None:
    try:
        with tempfile.TemporaryDirectory(prefix="farfield-") as folder:
            if _bake_one_cell(Path(folder), stop):
                stamp.parent.mkdir(parents=True, exist_ok=True)
                stamp.touch()
    except (FarfieldError, OSError):
        return


def _bake_one_cell(folder: Path, stop: threading.Event) -> bool:
    """Bake a cell among a few towers; False if that did not work."""
    model = folder / "towers.ply"
    model.write_text(_towers(), encoding="ascii")
    store = Store.open(folder / "store")
    scene = scenes.import_source(store, model)
    info = prepare_scene(store, scene, stopped=stop.is_set)
    corridor = parse_corridor({"box": {"min": [-5, 0, -5], "max": [5, 10, 5]}})
    walk = create_bake(store, info, corridor, BakeSettings(resolution=64, layers=8))
    with LocalDispatcher(store, jobs=1) as dispatcher:
        dispatcher.submit(walk.id)
        while not stop.is_set():
            status = dispatcher.wait(walk.id, timeout=0.2)
            if status.state in ("done", "failed"):
                return status.state == "done"
    return False


def _towers() -> str:
    """A PLY file of upright squares, near and far, all around the origin."""
    vertices: list[str] = []
    faces: list[str] = []
    for n in range(64):
        x, z = (n % 8 - 3.5) * 120, (n // 8 - 3.5) * 120
        first = len(vertices)
        vertices += [f"{x + dx} {y} {z + dx} 200 150 {n}" for dx in (-20, 20) for y in (0, 40)]
        faces += [f"3 {first} {first + 1} {first + 3}", f"3 {first} {first + 3} {first + 2}"]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"property uchar {color}" for color in ("red", "green", "blue")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    return "\n".join([*header, "end_header", *vertices, *faces, ""])


def _stamp() -> Path:
    """The file that says that this version of the code is warm on this machine."""
    digest = hashlib.sha256(sys.version.encode())
    package = Path(farfield_worker.__file__).parent
    for file in sorted(package.rglob("*.py")):
        digest.update(f"{file} {file.stat().st_mtime_ns}".encode())
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "farfield" / f"warm-{digest.hexdigest()[:16]}"
