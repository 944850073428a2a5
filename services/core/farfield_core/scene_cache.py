"""Prepared scenes of a store that is no folder, kept on this machine for all its processes.

The first process that needs a scene fetches it, the others wait for it and then map the same files.
Each holds a shared lock as long as it lives; what is not locked and was used longest ago goes when
the cache has more than its cap of bytes.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from farfield_core import layout
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store

#: bytes that a machine's cache may hold, beside what is in use
CAP = 50 << 30

#: locks that this process holds, by the folder they are about
_held: dict[Path, IO[bytes]] = {}


def cache_folder() -> Path:
    """Where this machine keeps scenes: FARFIELD_CACHE, or a folder in the user's cache."""
    place = os.environ.get("FARFIELD_CACHE")
    if place:
        return Path(place)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "farfield" / "scenes"


def cache_cap() -> int:
    """Bytes that the cache may hold: FARFIELD_CACHE_BYTES; raises BadInputError."""
    text = os.environ.get("FARFIELD_CACHE_BYTES") or str(CAP)
    try:
        return int(text)
    except ValueError:
        raise BadInputError(
            f"FARFIELD_CACHE_BYTES cannot be {text!r}; give a whole number of bytes."
        ) from None


def cached_scene(store: Store, scene: str) -> Path:
    """The prepared scene on this machine, fetched if need be; raises NotFoundError.

    It stays as long as this process lives.
    """
    root = cache_folder()
    root.mkdir(parents=True, exist_ok=True)
    name = hashlib.sha256(f"{store.url}\n{scene}".encode()).hexdigest()[:32]
    folder = root / name
    if folder not in _held:
        with _locked(root / f"{name}.lock") as lock:
            if not folder.exists():
                _fetch(store, scene, folder)
            fcntl.flock(lock, fcntl.LOCK_SH)
            _held[folder] = lock
    os.utime(folder)
    _shrink(root, cache_cap())
    return folder


def release_scenes() -> None:
    """Hold on to no scene any more."""
    while _held:
        _held.popitem()[1].close()


@contextmanager
def _locked(path: Path) -> Iterator[IO[bytes]]:
    """An exclusively locked file; the lock stays unless the block fails."""
    file = path.open("ab")
    try:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield file
    except BaseException:
        file.close()
        raise


def _fetch(store: Store, scene: str, folder: Path) -> None:
    prefix = layout.prepared_prefix(scene)
    if not store.exists(layout.scene_key(scene)):
        raise NotFoundError(f"There is no prepared scene {scene} in the store.")
    part = folder.with_name(folder.name + ".part")
    shutil.rmtree(part, ignore_errors=True)  # of a process that was killed
    try:
        for key in store.list(prefix):
            path = part / key.removeprefix(prefix)
            path.parent.mkdir(parents=True, exist_ok=True)
            store.fetch(key, path)
        part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _shrink(root: Path, cap: int) -> None:
    """Remove what nobody uses, least recently used first, while there is more than `cap`."""
    scenes = [path for path in root.iterdir() if path.is_dir() and path.suffix == ""]
    sizes = {path: _bytes(path) for path in scenes}
    total = sum(sizes.values())
    for folder in sorted(scenes, key=_used):
        if total <= cap:
            return
        if folder in _held:
            continue
        with (root / f"{folder.name}.lock").open("ab") as lock, suppress(BlockingIOError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
            total -= sizes[folder]


def _used(folder: Path) -> float:
    return folder.stat().st_mtime if folder.exists() else 0.0


def _bytes(folder: Path) -> int:
    total = 0
    for path in folder.rglob("*"):
        with suppress(FileNotFoundError):
            total += path.stat().st_size
    return total
