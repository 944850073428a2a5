"""Scenes in a store: importing a source, and how far its preparation has come."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from farfield_core import layout, sources
from farfield_core.errors import NotFoundError
from farfield_core.scene import PreparedScene, SceneInfo, open_scene
from farfield_core.scene_cache import cached_scene
from farfield_core.store import Store
from farfield_core.validation import parse

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


def import_source(store: Store, model: Path) -> str:
    """Copy a model file and the files it names into the store; returns the scene's id.

    The same bytes give the same scene. Raises SceneRefusedError for what is no model file.
    """
    files = sources.source_files(model)
    scene = sources.scene_id(files)
    prefix = layout.source_prefix(scene)
    # the model last: a scene is uploaded when its model is there
    for name, path in reversed(files.items()):
        if name == model.name and _model_name(store, scene) is not None:
            break
        store.put_new(prefix + name, path)
    return scene


def scene_ids(store: Store) -> list[str]:
    """All scenes of a store, sorted."""
    return sorted({key.split("/")[1] for key in store.list("scenes/")})


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
