"""What a command works on: a model file, or the id of a scene in a store."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from farfield_core import scenes, sources
from farfield_core.dispatch.prepare import forget_scene, prepare_scene
from farfield_core.errors import NotFoundError, SceneRefusedError
from farfield_core.scene import SceneInfo
from farfield_core.store import Store

from farfield.progress import working


def is_file(scene: str) -> bool:
    """Whether `scene` means a model file rather than a scene's id."""
    return sources.is_model(scene) or Path(scene).exists()


def prepared_scene(store: Store, scene: str) -> SceneInfo:
    """The prepared scene of a model file or a scene's id, prepared into the store if need be.

    Raises NotFoundError, and SceneRefusedError, after which nothing of the scene is left.
    """
    identity = None
    try:
        if not is_file(scene):
            scenes.scene_state(store, scene)
            return prepare_in(store, scene, scene)
        sources.source_files(Path(scene))  # complain before anything is said to be read
        with working(f"Reading {Path(scene).name}"):
            identity = scenes.import_source(store, Path(scene))
        return prepare_in(store, identity, Path(scene).name)
    except (NotFoundError, SceneRefusedError):
        if identity is not None:
            forget_scene(store, identity)
        store.remove_if_empty()
        raise


def prepare_in(store: Store, scene: str, name: str) -> SceneInfo:
    """Prepare an uploaded scene, saying so."""
    try:
        return scenes.scene_info(store, scene)
    except NotFoundError:
        with working(f"Preparing {name}"):
            return prepare_scene(store, scene)


@contextmanager
def borrowed_scene(place: str, scene: str) -> Iterator[tuple[Store, SceneInfo]]:
    """A prepared scene to look at; a model file that the store lacks leaves no trace in it."""
    if is_file(scene):
        identity = sources.scene_id(sources.source_files(Path(scene)))
        try:
            store = Store.open(place, create=False)
            info = scenes.scene_info(store, identity)
        except NotFoundError:
            with tempfile.TemporaryDirectory(prefix="farfield-") as folder:
                borrowed = Store.open(folder)
                yield borrowed, prepared_scene(borrowed, scene)
            return
        yield store, info
        return
    store = Store.open(place, create=False)
    yield store, scenes.scene_info(store, scene)
