"""Scenes as a server sees them: uploads are kept as they came and prepared in another process."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple, Protocol

from farfield_core import scenes
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


class Described(NamedTuple):
    """A scene; `info` once it is ready, `reason` once it is refused."""

    id: str
    name: str
    state: Literal["preparing", "ready", "refused"]
    reason: str | None
    info: SceneInfo | None


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

    def add(self, name: str, file: BinaryIO) -> str:
        """Keep a model file and have it prepared; returns its id.

        Raises SceneRefusedError for what is no model file.
        """
        with tempfile.TemporaryDirectory(prefix="farfield-upload-") as folder:
            model = Path(folder) / safe_name(name)
            if not model.suffix:
                raise SceneRefusedError("The file needs a name with a suffix, such as model.glb.")
            with model.open("wb") as out:
                shutil.copyfileobj(file, out, _CHUNK)
            scene = scenes.import_source(self._store, model)
        if scenes.scene_state(self._store, scene).state == "uploaded":
            self._preparer.submit(scene)
        return scene

    def ids(self) -> list[str]:
        """All scenes."""
        return scenes.scene_ids(self._store)

    def describe(self, scene: str) -> Described:
        """A scene, and how far it has come; raises NotFoundError."""
        found = scenes.scene_state(self._store, scene)
        if found.state == "ready":
            info = scenes.scene_info(self._store, scene)
            return Described(scene, found.name, "ready", None, info)
        reason = found.reason if found.state == "refused" else self._preparer.error(scene)
        return Described(scene, found.name, "refused" if reason else "preparing", reason, None)

    def take_up(self) -> None:
        """Prepare what was uploaded before this server started."""
        for scene in self.ids():
            if scenes.scene_state(self._store, scene).state == "uploaded":
                self._preparer.submit(scene)

    def close(self) -> None:
        """Prepare nothing more."""
        self._preparer.close()
