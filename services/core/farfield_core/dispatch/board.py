"""What workers and the feeder tell each other through Redis, beside the queue.

    farfield:slot:<worker>:<process>  who a process is, its cell, its figures; expires
    farfield:baking:<bake>:<cell>     which process bakes a cell; expires
    farfield:reports:<bake>           cells done and tried, oldest first; expires
    farfield:cancelled:<bake>         processes with a cell of this bake are to drop it; expires
    farfield:aside                    workers that are to bake no more, and why

All of it is hearsay that may be lost at any time: the store is what counts.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from redis import Redis

from farfield_core.dispatch.slots import Slot

#: seconds between signs of life, and after which a process counts as lost
BEAT, LOST = 1.0, 10
#: reports kept for a feeder that is away
_KEPT = 10_000
#: seconds for which reports and cancellations are kept
_EXPIRE = 3600


@dataclass(frozen=True)
class Report:
    """What became of a cell: done, or tried in vain for `reason`.

    `attempt` names the attempt that went wrong.
    """

    cell: str
    worker: str
    figures: dict[str, float] = field(default_factory=dict)
    reason: str = ""
    attempt: str = ""


@dataclass(frozen=True)
class Orders:
    """What a process is told when it gives a sign of life."""

    cancelled: bool
    aside: bool


class Board:
    """The keys above; every method raises what redis-py raises.

    Processes that give signs of life through this board count as lost after `lost` seconds.
    """

    def __init__(self, broker: str, lost: int = LOST) -> None:
        self._lost = lost
        self._redis: Redis = Redis.from_url(
            broker, socket_timeout=10, socket_connect_timeout=5, decode_responses=True
        )

    def claim(self, slot: Slot) -> bool:
        """Whether no other process bakes the slot's cell."""
        return bool(self._redis.set(_cell_key(slot), _slot_key(slot), nx=True, ex=self._lost))

    def release(self, slot: Slot) -> None:
        """The slot's cell is no longer under way."""
        self._redis.delete(_cell_key(slot))

    def beat(self, slot: Slot) -> Orders:
        """Give a sign of life."""
        with self._redis.pipeline(transaction=False) as pipe:
            if slot.cell:
                pipe.set(_cell_key(slot), _slot_key(slot), ex=self._lost)
            pipe.set(_slot_key(slot), json.dumps(asdict(slot)), ex=self._lost)
            pipe.exists(f"farfield:cancelled:{slot.bake}")
            pipe.hexists("farfield:aside", slot.worker)
            cancelled, aside = pipe.execute()[-2:]
        return Orders(bool(slot.bake and cancelled), bool(aside))

    def leave(self, slot: Slot) -> None:
        """Say that a process ends."""
        self._redis.delete(_slot_key(slot))

    def report(self, bake: str, report: Report) -> None:
        """Tell the feeder what became of a cell."""
        key = f"farfield:reports:{bake}"
        with self._redis.pipeline(transaction=False) as pipe:
            pipe.rpush(key, json.dumps(asdict(report)))
            pipe.ltrim(key, -_KEPT, -1)
            pipe.expire(key, _EXPIRE)
            pipe.execute()

    def reports(self, bake: str) -> list[Report]:
        """Take what was told of a bake."""
        texts: Any = self._redis.lpop(f"farfield:reports:{bake}", _KEPT)
        return [_read(Report, text) for text in texts or ()]

    def slots(self) -> list[Slot]:
        """All processes that gave a sign of life lately."""
        keys = list(self._redis.scan_iter("farfield:slot:*", count=1000))
        texts: Any = self._redis.mget(keys) if keys else []
        return [_read(Slot, text) for text in texts if text]

    def cancel(self, bakes: Iterable[str]) -> None:
        """Have processes drop their cells of these bakes."""
        for bake in bakes:
            self._redis.set(f"farfield:cancelled:{bake}", 1, ex=_EXPIRE)

    def allow(self, bake: str) -> None:
        """Take a cancellation back."""
        self._redis.delete(f"farfield:cancelled:{bake}")

    def set_aside(self, worker: str, reason: str) -> None:
        """Have a worker bake no more until it is started anew."""
        self._redis.hset("farfield:aside", worker, reason)

    def aside(self) -> dict[str, str]:
        """Workers that bake no more, and why."""
        found: Any = self._redis.hgetall("farfield:aside")
        return dict(found)

    def forget(self, worker: str) -> None:
        """A worker that was set aside is gone."""
        self._redis.hdel("farfield:aside", worker)

    def close(self) -> None:
        """Free the connection."""
        self._redis.close()


def _slot_key(slot: Slot) -> str:
    return f"farfield:slot:{slot.worker}:{slot.process}"


def _cell_key(slot: Slot) -> str:
    return f"farfield:baking:{slot.bake}:{slot.cell}"


def _read(kind: type[Any], text: str) -> Any:
    """Members that another version of the code knows and this one does not are left out."""
    known = {member.name for member in fields(kind)}
    return kind(**{name: value for name, value in json.loads(text).items() if name in known})
