"""Scenes as a server sees them: uploads are kept as they came and prepared in another process."""

from __future__ import annotations

import re
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple, Protocol

from farfield_core import archives, scenes, sources
from farfield_core.errors import SceneRefusedError
from farfield_core.scene import SceneInfo
from farfield_core.store import Store

_CHUNK = 1 << 20


def safe_name(name: str) -> str:
    """A plain file name made of what a client calls its file: no folders, nothing odd."""
    last = re.split(r"[/\\]", name)[-1]
    plain = re.sub(r"[^\w.() -]", "_", last).strip(" .")
    stem, dot, suffix = plain.rpartition(".")
    return f"{stem[:100]}{dot}{suffix[:10]}"


def check_name(name: str) -> str:
    """A plain name of a model file or of a zip; raises SceneRefusedError for any other."""
    plain = safe_name(name)
    if not (sources.is_model(plain) or archives.is_archive(plain)):
        known = ", ".join((*sources.SUFFIXES, ".zip"))
        raise SceneRefusedError(
            f"{plain or 'A file without a name'} cannot be read as a model; give one of {known}."
        )
    return plain


class Described(NamedTuple):
    """A scene; `info` once it is ready, `reason` once it is refused."""

    id: str
    name: str
    state: Literal["preparing", "ready", "refused"]
    reason: str | None
    info: SceneInfo | None
    orientation: scenes.Orientation


class Preparer(Protocol):
    """Prepares uploaded scenes, one way or another."""

    def submit(self, scene: str) -> None:
        """Have a scene prepared; nothing happens if that is under way."""
        ...

    def error(self, scene: str) -> str | None:
        """Why a scene could not be prepared though it was not refused, such as a full disk."""
        ...

    def close(self) -> None:
        """Stop all work."""
        ...


class Scenes:
    """All scenes of a store."""

    def __init__(self, store: Store, preparer: Preparer) -> None:
        self._store = store
        self._preparer = preparer
        # scene.json lists every block of a large scene, and never changes
        self.info = lru_cache(maxsize=32)(lambda scene: scenes.scene_info(store, scene))

    def add(self, name: str, file: BinaryIO, work: Path) -> str:
        """Keep a model file, or a zip with one, and have it prepared; returns its id.

        `work` is a folder for what is needed meanwhile. Raises SceneRefusedError for what is no
        model file.
        """
        plain = check_name(name)
        with tempfile.TemporaryDirectory(prefix=".arriving-", dir=work) as folder:
            model = Path(folder) / plain
            with model.open("wb") as out:
                shutil.copyfileobj(file, out, _CHUNK)
            return self.take(model)

    def take(self, file: Path) -> str:
        """Keep a file that is ours, alone in its folder, and have it prepared; returns its id."""
        model = file
        if archives.is_archive(file.name):
            inside = file.with_name("unpacked")
            inside.mkdir()
            model = archives.unpack_model(file, inside)
        scene = scenes.import_source(self._store, model, owned=True)
        self.prepare(scene)
        return scene

    def prepare(self, scene: str) -> None:
        """Have a scene prepared unless that is done or was refused."""
        if scenes.scene_state(self._store, scene).state == "uploaded":
            self._preparer.submit(scene)

    def reorient(self, scene: str, orientation: scenes.Orientation) -> str:
        """The same model turned and scaled otherwise; returns that scene's id."""
        turned = scenes.reorient(self._store, scene, orientation)
        self.prepare(turned)
        return turned

    def ids(self) -> list[str]:
        """All scenes."""
        return scenes.scene_ids(self._store)

    def describe(self, scene: str) -> Described:
        """A scene, and how far it has come; raises NotFoundError."""
        found = scenes.scene_state(self._store, scene)
        said = scenes.orientation(self._store, scene)
        if found.state == "ready":
            info = self.info(scene)
            return Described(scene, found.name, "ready", None, info, said)
        reason = found.reason if found.state == "refused" else self._preparer.error(scene)
        state: Literal["refused", "preparing"] = "refused" if reason else "preparing"
        return Described(scene, found.name, state, reason, None, said)

    def take_up(self) -> None:
        """Prepare what was uploaded before this server started."""
        for scene in self.ids():
            if scenes.scene_state(self._store, scene).state == "uploaded":
                self._preparer.submit(scene)

    def close(self) -> None:
        """Prepare nothing more."""
        self._preparer.close()
