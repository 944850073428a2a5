"""Having scenes prepared by the workers of a farm; the store tells how far they have come."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from kombu.exceptions import OperationalError
from redis import Redis
from redis.exceptions import RedisError

from farfield_core import scenes
from farfield_core.dispatch.board import Board
from farfield_core.dispatch.queues import PREPARE_SCENE, SMALL, celery_app
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.store import Store

log = logging.getLogger(__name__)

#: what a process that prepares a scene names in place of a bake
PREPARING = "prepare"


class CeleryPreparer:
    """Sends scenes to be prepared, and again those that got lost on the way.

    Args:
        store: where scenes are.
        broker: redis://...
        patience: seconds for which a scene has to be nowhere before it is sent again.
    """

    def __init__(self, store: Store, broker: str, patience: float = 5.0) -> None:
        self._store = store
        self._app = celery_app(broker)
        self._redis: Redis = Redis.from_url(broker, socket_timeout=10, socket_connect_timeout=5)
        self._board = Board(broker)
        self._patience = patience
        #: scenes that were sent, and since when they are nowhere to be seen
        self._sent: dict[str, float | None] = {}
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="farfield-preparer", daemon=True)
        self._thread.start()

    def submit(self, scene: str) -> None:
        """Have an uploaded scene prepared."""
        with self._changed:
            # counts as lost at once: it is sent as soon as Redis can be reached
            self._sent.setdefault(scene, 0.0)
            self._changed.notify_all()

    def error(self, scene: str) -> str | None:
        """Nothing is known here that the store does not know."""
        return None

    def close(self) -> None:
        """Free everything; workers go on."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        self._redis.close()
        self._board.close()
        self._app.close()

    def _run(self) -> None:
        while True:
            with self._changed:
                if self._closed:
                    return
                scenes_sent = dict(self._sent)
            try:
                self._look(scenes_sent)
            except (OperationalError, RedisError, OSError, FarfieldError) as error:
                log.warning("scenes have to wait: %s", error)
            with self._changed:
                fresh = any(since == 0.0 for since in self._sent.values())
                self._changed.wait_for(
                    lambda: self._closed or any(s == 0.0 for s in self._sent.values()),
                    None if not self._sent else 1.0,
                )
                if fresh and not self._closed:  # Redis or the store is gone
                    self._changed.wait(1.0)

    def _look(self, sent: dict[str, float | None]) -> None:
        waiting: Any = self._redis.llen(SMALL) if sent else 0
        prepared = {slot.cell for slot in self._board.slots() if slot.bake == PREPARING}
        for scene, since in sent.items():
            now = time.monotonic()
            state: float | None
            if self._over(scene):
                with self._changed:
                    del self._sent[scene]
                continue
            if since == 0.0 or (since is not None and now - since >= self._patience):
                self._app.send_task(PREPARE_SCENE, [scene], queue=SMALL, retry=False)
                state = None
            elif waiting or scene in prepared:
                state = None
            else:
                state = since or now
            with self._changed:
                self._sent[scene] = state

    def _over(self, scene: str) -> bool:
        try:
            return scenes.scene_state(self._store, scene).state != "uploaded"
        except NotFoundError:
            return True
