"""Scenes in a store: importing a source, and how far its preparation has come."""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from farfield_core import layout, sources
from farfield_core.errors import NotFoundError
from farfield_core.scene import PreparedScene, SceneInfo, open_scene
from farfield_core.scene_cache import cached_scene
from farfield_core.store import Store
from farfield_core.validation import Number, parse

State = Literal["uploaded", "ready", "refused"]


@dataclass(frozen=True)
class SceneState:
    """How far a scene has come.

    Attributes:
        id: the scene.
        name: what to call it.
        state: "preparing" is not kept in the store: whoever prepares an uploaded scene knows.
        reason: why it was refused, one sentence.
    """

    id: str
    name: str
    state: State
    reason: str | None = None


class Orientation(BaseModel):
    """How a model's own coordinates become metres with y up.

    Attributes:
        up: which of the model's axes points up.
        scale: metres in one of the model's units.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    up: Literal["y", "z"] = "y"
    scale: Number = Field(default=1.0, gt=0, le=1e6)

    def arguments(self) -> list[str]:
        """Options of the process that prepares."""
        if self == Orientation():
            return []
        return ["--up", self.up, "--scale", repr(self.scale)]


class _Turned(BaseModel):
    """orientation.json of a scene made of another one's model."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    of: str
    by: Orientation


def import_source(store: Store, model: Path, *, owned: bool = False) -> str:
    """Take a model file and the files it names into the store; returns the scene's id.

    Files that are `owned`, which nobody will write to, are linked where the store is a folder of
    the same disk; others are copied. The same bytes give the same scene. Raises SceneRefusedError
    for what is no model file.
    """
    files = sources.source_files(model)
    scene = sources.scene_id(files)
    prefix = layout.source_prefix(scene)
    # the model last: a scene is uploaded when its model is there
    for name, path in reversed(files.items()):
        if name == model.name and _model_name(store, scene) is not None:
            break
        _keep(store, prefix + name, path, link=owned)
    return scene


def _keep(store: Store, key: str, data: Path | bytes, *, link: bool) -> None:
    """Create an object."""
    target = store.local_path(key)
    if link and target is not None and isinstance(data, Path):
        with suppress(OSError):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.hardlink_to(data)
            return
    store.put_new(key, data)


def reorient(store: Store, scene: str, orientation: Orientation) -> str:
    """The same model turned and scaled otherwise: a scene of its own; returns its id.

    What was baked of the first stays as it is. Raises NotFoundError.
    """
    prefix = layout.source_prefix(scene)
    keys = sorted(store.list(prefix), key=sources.is_model)
    if not keys:
        raise NotFoundError(f"There is no scene {scene} in the store.")
    first = _root_of(store, scene)
    if orientation == Orientation():
        return first
    text = f"{first} {orientation.model_dump_json()}"
    turned = hashlib.sha256(text.encode()).hexdigest()[:16]
    said = _Turned(of=first, by=orientation).model_dump_json().encode()
    store.put_new(layout.orientation_key(turned), said)
    for key in keys:
        path = store.local_path(key)
        target = layout.source_prefix(turned) + key.removeprefix(prefix)
        _keep(store, target, store.get(key) if path is None else path, link=True)
    return turned


def orientation(store: Store, scene: str) -> Orientation:
    """How a scene's model is turned and scaled while it is prepared."""
    try:
        data = store.get(layout.orientation_key(scene))
    except NotFoundError:
        return Orientation()
    return parse(_Turned, data, f"The orientation of scene {scene}").by


def _root_of(store: Store, scene: str) -> str:
    """The scene as it was uploaded, of which this one is a turned copy or which it is."""
    try:
        data = store.get(layout.orientation_key(scene))
    except NotFoundError:
        return scene
    return parse(_Turned, data, f"The orientation of scene {scene}").of


def scene_ids(store: Store) -> list[str]:
    """All scenes of a store, sorted."""
    return list(store.folders("scenes/"))


def scene_state(store: Store, scene: str) -> SceneState:
    """How far a scene has come; raises NotFoundError."""
    if store.exists(layout.scene_key(scene)):
        return SceneState(scene, scene_info(store, scene).name, "ready")
    model = _model_name(store, scene)
    if model is None:
        raise NotFoundError(f"There is no scene {scene} in the store.")
    name = PurePosixPath(model).stem
    try:
        reason = str(json.loads(store.get(layout.refused_key(scene)))["reason"])
    except NotFoundError:
        return SceneState(scene, name, "uploaded")
    return SceneState(scene, name, "refused", reason)


def scene_info(store: Store, scene: str) -> SceneInfo:
    """scene.json of a prepared scene; raises NotFoundError."""
    try:
        data = store.get(layout.scene_key(scene))
    except NotFoundError:
        raise NotFoundError(f"There is no prepared scene {scene} in the store.") from None
    return parse(SceneInfo, data, f"The prepared scene {scene}")


def source_model(store: Store, scene: str, into: Path) -> Path:
    """The model file of an uploaded scene on this machine, copied `into` a folder if need be.

    Raises NotFoundError.
    """
    model = _model_name(store, scene)
    if model is None:
        raise NotFoundError(f"There is no scene {scene} in the store.")
    return _local_folder(store, layout.source_prefix(scene), into) / model


def prepared_folder(store: Store, scene: str, into: Path | None = None) -> Path:
    """The prepared scene on this machine, copied where the store is no folder.

    It is copied `into` a folder, or into this machine's cache. Raises NotFoundError if it is not
    (yet) there.
    """
    if into is None and store.local_path(layout.prepared_prefix(scene)) is None:
        return cached_scene(store, scene)
    if not store.exists(layout.scene_key(scene)):
        raise NotFoundError(f"There is no prepared scene {scene} in the store.")
    return _local_folder(store, layout.prepared_prefix(scene), into)


def open_prepared(store: Store, scene: str, into: Path | None = None) -> PreparedScene:
    """Map a prepared scene; see `prepared_folder`."""
    return open_scene(prepared_folder(store, scene, into))


def refuse(store: Store, scene: str, reason: str) -> None:
    """Remember why a scene cannot be prepared; what there is of it besides its source goes."""
    store.delete_prefix(layout.prepared_prefix(scene))
    store.put(layout.refused_key(scene), json.dumps({"reason": reason}).encode())


def publish(store: Store, scene: str, prepared: Path) -> None:
    """Move a freshly prepared folder into the store; scene.json last, as it says "ready"."""
    prefix = layout.prepared_prefix(scene)
    target = store.local_path(prefix)
    store.delete(layout.refused_key(scene))
    if target is not None and not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        prepared.rename(target)
        return
    files = sorted(path for path in prepared.rglob("*") if path.is_file())
    files.sort(key=lambda path: path.name == "scene.json")
    for path in files:
        store.put(prefix + path.relative_to(prepared).as_posix(), path)


def _model_name(store: Store, scene: str) -> str | None:
    """Name of the model among a scene's source files; None if it has not arrived."""
    prefix = layout.source_prefix(scene)
    names = (key.removeprefix(prefix) for key in store.list(prefix))
    models = [name for name in names if "/" not in name and sources.is_model(name)]
    return min(models, default=None)


def _local_folder(store: Store, prefix: str, into: Path | None) -> Path:
    folder = store.local_path(prefix)
    if folder is not None:
        return folder
    assert into is not None
    target = into / prefix
    for key in store.list(prefix):
        path = into / key
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_name(path.name + ".part")
            store.fetch(key, part)
            part.rename(path)
    return target
