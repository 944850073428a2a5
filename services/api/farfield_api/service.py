"""What one server is made of: its store, its scenes, its bakes."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from farfield_core import scenes as core_scenes
from farfield_core.bake import create_bake
from farfield_core.choice import choose
from farfield_core.corridor import Corridor, Ground, parse_corridor
from farfield_core.dispatch import Dispatcher, FarmView, Listener
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.ground import ground_under
from farfield_core.scene import SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.suggest import Suggestion, suggest_corridor

from farfield_api.bakes import Bakes
from farfield_api.exceptions import NotNowError, QuotaError
from farfield_api.idempotency import forget_old
from farfield_api.keys import Keys
from farfield_api.packed import PackedObjects
from farfield_api.scenes import Preparer, Scenes
from farfield_api.settings import ApiSettings
from farfield_api.uploads import Uploads


class FarfieldService:
    """Everything the routes work with."""

    def __init__(
        self,
        settings: ApiSettings,
        store: Store,
        dispatcher: Callable[[Listener], Dispatcher],
        preparer: Preparer,
    ) -> None:
        self.settings = settings
        self.store = store
        self.keys = Keys(store, settings.api_keys)
        self.scenes = Scenes(store, preparer)
        self.uploads = Uploads(
            _uploads_folder(settings, store),
            self.scenes,
            settings.upload_hours * 3600,
            settings.quota_bytes,
        )
        self.bakes = Bakes(store, dispatcher)
        self.packed = PackedObjects(store)
        self.suggestion = lru_cache(maxsize=64)(self._suggest)

    @property
    def farm(self) -> FarmView | None:
        """What is known of the farm's workers; None where this server bakes by itself."""
        dispatcher = self.bakes.dispatcher
        return dispatcher if isinstance(dispatcher, FarmView) else None

    def take_up(self) -> None:
        """Go on where the server before this one stopped."""
        forget_old(self.store)
        self.scenes.take_up()
        self.uploads.take_up()
        self.bakes.take_up()

    def close(self) -> None:
        """Stop all work; the store knows what is left to do."""
        self.uploads.close()
        self.scenes.close()
        self.bakes.close()

    def ready_scene(self, scene: str) -> SceneInfo:
        """A prepared scene; raises NotFoundError, BadInputError, and NotNowError until it is."""
        found = self.scenes.describe(scene)
        if found.state == "refused":
            raise BadInputError(f"Scene {scene} was refused: {found.reason}")
        if found.info is None:
            raise NotNowError(f"Scene {scene} is still being prepared; ask again when it is ready.")
        return found.info

    def add_corridor(self, scene: str, corridor: Corridor) -> str:
        """Keep a corridor through a scene; the same corridor gets the same id."""
        data = corridor.model_dump_json(exclude_none=True).encode()
        corridor_id = hashlib.sha256(data).hexdigest()[:16]
        self.store.put_new(_corridor_key(scene, corridor_id), data)
        return corridor_id

    def corridor(self, scene: str, corridor: Corridor | str) -> Corridor:
        """The corridor that a request names or holds; raises NotFoundError."""
        if isinstance(corridor, Corridor):
            return corridor
        try:
            data = self.store.get(_corridor_key(scene, corridor))
        except NotFoundError:
            raise NotFoundError(
                f"There is no corridor {corridor} of scene {scene}; "
                f"POST /api/v1/scenes/{scene}/corridors keeps one."
            ) from None
        return parse_corridor(data, f"The corridor {corridor}")

    def ground(self, scene: str, corridor: Corridor) -> Ground | None:
        """What a corridor follows, where it does."""
        if not corridor.follow_ground:
            return None
        return ground_under(core_scenes.open_prepared(self.store, scene), corridor)

    def _suggest(self, scene: str) -> Suggestion:
        """A corridor to begin with; raises as `ready_scene` does."""
        self.ready_scene(scene)
        return suggest_corridor(core_scenes.open_prepared(self.store, scene))

    def create_bake(
        self, scene: str, corridor: Corridor, settings: BakeSettings, follows: str | None = None
    ) -> str:
        """Write a bake's manifest and have it baked; returns its id.

        Cells of the bake `follows` are reused where nothing else would come out.
        """
        info = self.ready_scene(scene)
        most = self.settings.quota_cells
        if most and (cells := choose(info, corridor, settings).plan.cells) > most:
            raise QuotaError(
                f"The corridor has {cells} cells, more than the {most} that this server bakes in "
                "one go; make it smaller, or its cells larger."
            )
        walk = create_bake(self.store, info, corridor, settings, follows=follows)
        self.bakes.start(walk.id)
        return walk.id


def _uploads_folder(settings: ApiSettings, store: Store) -> Path:
    """Where uploads grow: best on the store's own disk, which then only links them."""
    if settings.uploads:
        return Path(settings.uploads)
    return store.local_path("uploads") or Path(tempfile.gettempdir()) / "farfield-uploads"


def _corridor_key(scene: str, corridor: str) -> str:
    return f"scenes/{scene}/corridors/{corridor}.json"
