"""Cells in the farm's queues: sending them, seeing which wait, taking them back."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any, NamedTuple

from redis import Redis

from farfield_core.dispatch.queues import BAKE_CELL, Device, celery_app, cell_queues


class Waiting(NamedTuple):
    """How many cells wait: those a walker waits for, and all others."""

    urgent: int
    others: int


class Mail:
    """The queues of cells for one kind of worker; methods raise what kombu and redis-py raise."""

    def __init__(self, broker: str, device: Device) -> None:
        self._app = celery_app(broker, device)
        # a Redis that is there and does not answer must not hold the feeder up for ever
        self._app.conf.broker_transport_options["socket_timeout"] = 10
        self._redis: Redis = Redis.from_url(broker, socket_timeout=10, socket_connect_timeout=5)
        self._urgent, self._others = cell_queues(device)

    def send(self, bake: str, cell: str, avoid: Sequence[str], *, urgent: bool) -> None:
        """Have a cell baked, if possible by none of the workers `avoid`."""
        queue = self._urgent if urgent else self._others
        # one try: the feeder comes again, and must not hang meanwhile
        self._app.send_task(BAKE_CELL, [bake, cell, list(avoid)], queue=queue, retry=False)

    def waiting(self) -> Waiting:
        """How many cells wait."""
        with self._redis.pipeline(transaction=False) as pipe:
            pipe.llen(self._urgent)
            pipe.llen(self._others)
            urgent, others = pipe.execute()
        return Waiting(int(urgent), int(others))

    def peek(self) -> set[tuple[str, str]]:
        """Bake and cell of all that wait."""
        found: set[tuple[str, str]] = set()
        for queue in (self._urgent, self._others):
            messages: Any = self._redis.lrange(queue, 0, -1)
            found |= {_task(message) for message in messages}
        return found

    def withdraw(self, bake: str, urgent: bool) -> list[str]:
        """Take a bake's cells out of a queue; returns them in their order."""
        queue = self._urgent if urgent else self._others
        messages: Any = self._redis.lrange(queue, 0, -1)
        # the oldest is at the end
        mine = [
            (message, name)
            for message in reversed(messages)
            for whose, name in [_task(message)]
            if whose == bake
        ]
        with self._redis.pipeline(transaction=False) as pipe:
            for message, _ in mine:
                pipe.lrem(queue, -1, message)
            removed = pipe.execute()
        # what a worker has taken meanwhile is its own
        return [name for (_, name), count in zip(mine, removed, strict=True) if count]

    def close(self) -> None:
        """Free the connections."""
        self._redis.close()
        self._app.close()


def _task(message: bytes) -> tuple[str, str]:
    """Bake and cell of a message in a queue."""
    (bake, cell, *_), *_ = json.loads(base64.b64decode(json.loads(message)["body"]))
    return str(bake), str(cell)
