"""Baking on a farm: cells go out over Redis, and the store tells which of them came back.

Redis remembers nothing that matters. A feeder keeps the queue short, so pausing and cancelling act
at once, and cells near a walker overtake the others. While the queue is empty, cells that were sent
a while ago and have neither arrived nor failed are sent again: this mends whatever Redis or a
worker lost, and at worst bakes a cell twice, which changes nothing.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Iterable
from typing import Literal

from kombu.exceptions import OperationalError
from redis import Redis
from redis.exceptions import RedisError

from farfield_core.bake import done_cells
from farfield_core.cells import cell_name
from farfield_core.control import forget_failures, read_failures
from farfield_core.dispatch import ENDED, BakeStatus, Event, Listener
from farfield_core.dispatch.jobs import Job
from farfield_core.dispatch.queues import (
    BAKE_CELL,
    CELLS,
    FIRST,
    PREPARE_SCENE,
    SMALL,
    celery_app,
)
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.store import Store

log = logging.getLogger(__name__)

_REDIS_ERRORS = (OperationalError, RedisError, ConnectionError, TimeoutError)


class CeleryDispatcher:
    """Bakes by Celery workers that share the store.

    Args:
        store: a store that the workers open by the same address.
        broker: redis://...
        listener: called from a thread of its own with every event, one at a time.
        queue_limit: greatest number of cells that wait in the queue.
        interval: seconds between looks into the store; five times as long as a look takes if that
            is more.
        patience: seconds after which a cell that was sent may be sent again.
    """

    def __init__(
        self,
        store: Store,
        broker: str,
        listener: Listener | None = None,
        queue_limit: int = 2000,
        interval: float = 1.0,
        patience: float = 60.0,
    ) -> None:
        self._store = store
        self._app = celery_app(broker)
        self._redis: Redis = Redis.from_url(broker, socket_timeout=10)
        self._listener = listener
        self._queue_limit = queue_limit
        self._interval = interval
        self._patience = patience
        self._jobs: dict[str, Job] = {}
        self._sent: dict[tuple[str, str], float] = {}
        self._told: dict[str, str] = {}
        self._events: deque[Event] = deque()
        self._closed = False
        self._hurry = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="farfield-feeder", daemon=True)
        self._thread.start()

    def submit(self, bake: str) -> None:
        """Bake every missing cell of a bake; nothing happens if that is under way."""
        with self._changed:
            job = self._jobs.get(bake)
            if job is not None and job.state not in ENDED:
                return
        forget_failures(self._store, bake)
        job = Job(self._store, bake)
        with self._changed:
            self._jobs[bake] = job
            self._forget_sent(bake)
            self._wake()

    def first(self, bake: str, cells: Iterable[str]) -> None:
        """Bake these cells before all others; the first named comes first."""
        with self._changed:
            job = self._job(bake)
            wanted = list(dict.fromkeys(cells))
            # What was put first before gives way, and what waits in the long queue is sent again.
            self._withdraw(FIRST, bake)
            for cell in wanted:
                if cell in job.running:
                    self._put_back(job, cell)
            job.first(wanted)
            if job.state not in ("queued", "running"):
                return
            chosen = set(wanted)
            while (near := job.take()) is not None:
                if near not in chosen:
                    job.put_back(near)
                    break
                self._send(job, near, FIRST)

    def pause(self, bake: str) -> None:
        """Begin no more cells; those under way are finished."""
        self._stop(bake, "paused")

    def resume(self, bake: str) -> None:
        """Go on with a paused bake."""
        with self._changed:
            job = self._job(bake)
            if job.state == "paused":
                job.state = "queued"
            self._wake()

    def cancel(self, bake: str) -> None:
        """Begin no more cells; what is done stays, and `submit` takes the bake up again."""
        self._stop(bake, "cancelled")

    def retry(self, bake: str) -> None:
        """Try failed cells anew."""
        forget_failures(self._store, bake)
        with self._changed:
            self._job(bake).retry()
            self._wake()

    def status(self, bake: str) -> BakeStatus:
        """Where a bake stands; raises NotFoundError for one never submitted."""
        with self._changed:
            return self._job(bake).status()

    def wait(self, bake: str, timeout: float | None = None) -> BakeStatus:
        """Wait until a bake has ended, or for `timeout` seconds."""
        with self._changed:
            job = self._job(bake)
            self._changed.wait_for(lambda: job.state in ENDED, timeout)
            return job.status()

    def close(self) -> None:
        """Feed the farm no more; workers finish what is in the queue."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        self._redis.close()
        self._app.close()

    def _job(self, bake: str) -> Job:
        try:
            return self._jobs[bake]
        except KeyError:
            raise NotFoundError(f"There is no bake {bake} under way.") from None

    def _stop(self, bake: str, state: Literal["paused", "cancelled"]) -> None:
        with self._changed:
            job = self._job(bake)
            if job.state not in ENDED:
                job.state = state
            for queue in (FIRST, CELLS):
                self._withdraw(queue, bake)
            self._wake()

    def _run(self) -> None:
        """The feeder: look into the store, send what is missing, tell, rest."""
        while True:
            started = time.monotonic()
            try:
                for job in self._under_way():
                    self._look(job)
                with self._changed:
                    self._feed()
                self._tell()
            except _REDIS_ERRORS as error:
                log.warning("Redis does not answer, trying on: %s", error)
            except FarfieldError as error:
                log.warning("the store does not answer, trying on: %s", error)
            rest = max(self._interval, 5 * (time.monotonic() - started))
            with self._changed:
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._closed or self._hurry, rest)
                self._hurry = False
                if self._closed:
                    return

    def _under_way(self) -> list[Job]:
        with self._changed:
            return [job for job in self._jobs.values() if job.running]

    def _wake(self) -> None:
        """Let the feeder look at once."""
        self._hurry = True
        self._changed.notify_all()

    def _look(self, job: Job) -> None:
        """Take in what the store says of the cells under way."""
        done = {cell_name(index) for index in done_cells(self._store, job.bake)}
        failed = read_failures(self._store, job.bake)
        with self._changed:
            for cell in sorted(job.running):
                if cell in done:
                    job.done(cell)
                    self._events.append(Event(job.bake, "done", job.state, cell))
                elif cell in failed:
                    reason = failed[cell]
                    job.fail(cell, reason)
                    self._events.append(Event(job.bake, "failed", job.state, cell, reason=reason))
                else:
                    continue
                self._sent.pop((job.bake, cell), None)

    def _feed(self) -> None:
        """Fill the queue up to its limit; send again what is lost."""
        urgent, waiting = self._redis.llen(FIRST), self._redis.llen(CELLS)
        if urgent == waiting == 0:
            late = time.monotonic() - self._patience
            for (bake, cell), sent in list(self._sent.items()):
                if sent < late:
                    self._put_back(self._jobs[bake], cell)
        room = self._queue_limit - waiting
        for job in self._jobs.values():
            while room > 0 and (following := job.take()) is not None:
                self._send(job, following, CELLS)
                room -= 1

    def _send(self, job: Job, cell: str, queue: str) -> None:
        try:
            self._app.send_task(BAKE_CELL, [job.bake, cell], queue=queue)
        except BaseException:
            job.put_back(cell)
            raise
        self._sent[job.bake, cell] = time.monotonic()

    def _withdraw(self, queue: str, bake: str) -> None:
        """Take a bake's cells out of a queue; they wait here again, in the same order."""
        mine: list[list[str]] = []
        others: list[list[str]] = []
        with self._app.connection_for_write() as connection:
            while (message := connection.default_channel.basic_get(queue, no_ack=True)) is not None:
                arguments, *_ = message.decode()
                (mine if arguments[0] == bake else others).append(arguments)
        for arguments in others:
            self._app.send_task(BAKE_CELL, arguments, queue=queue)
        for _, cell in reversed(mine):
            self._put_back(self._jobs[bake], cell)

    def _put_back(self, job: Job, cell: str) -> None:
        self._sent.pop((job.bake, cell), None)
        if cell in job.running:
            job.put_back(cell)

    def _forget_sent(self, bake: str) -> None:
        for key in [key for key in self._sent if key[0] == bake]:
            del self._sent[key]

    def _tell(self) -> None:
        """Tell of cells, then of every bake whose state is another than was told last."""
        with self._changed:
            for bake, job in self._jobs.items():
                if self._told.get(bake) != job.state:
                    self._told[bake] = job.state
                    self._events.append(Event(bake, "state", job.state, reason=job.reason))
        while self._events:
            event = self._events.popleft()
            if self._listener is not None:
                self._listener(event)


class CeleryPreparer:
    """Has scenes prepared by Celery workers; the store tells how far they have come."""

    def __init__(self, broker: str) -> None:
        self._app = celery_app(broker)

    def submit(self, scene: str) -> None:
        """Have an uploaded scene prepared."""
        self._app.send_task(PREPARE_SCENE, [scene], queue=SMALL)

    def error(self, scene: str) -> str | None:
        """Nothing is known here that the store does not know."""
        return None

    def close(self) -> None:
        """Free everything; workers go on."""
        self._app.close()
