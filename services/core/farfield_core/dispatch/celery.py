"""Baking on a farm: cells go out over Redis, and the store tells which of them came back.

Redis remembers nothing that matters. A feeder keeps the queue short, so pausing and cancelling act
at once, and cells near a walker overtake the others. Workers say what they bake and what became of
it (`board`), which makes progress cheap to follow; a bake ends only when the store lists its cells.
A cell that was sent, but that no queue holds and no living process bakes, is lost and sent again:
this mends whatever Redis or a worker lost.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Literal

from kombu.exceptions import OperationalError
from redis.exceptions import RedisError

from farfield_core import control
from farfield_core.bake import done_names
from farfield_core.dispatch import ENDED, BakeStatus, Event, Listener
from farfield_core.dispatch.blame import Blame
from farfield_core.dispatch.board import Board, Report
from farfield_core.dispatch.jobs import Job
from farfield_core.dispatch.mail import Mail
from farfield_core.dispatch.queues import Device
from farfield_core.dispatch.slots import Slot
from farfield_core.dispatch.wanted import wanted_workers
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.store import Store

log = logging.getLogger(__name__)

_REDIS_ERRORS = (OperationalError, RedisError, ConnectionError, TimeoutError)

#: seconds between lists of a bake's cells, and how much longer than a list takes that has to be
_LIST, _LIST_SHARE = 5.0, 5
#: cells taken in, and cells sent, in one go
_PORTION, _SENT_AT_ONCE = 1000, 10
#: seconds between looks into a queue that is not empty
_PEEK = 5.0


class CeleryDispatcher:
    """Bakes by Celery workers that share the store.

    Args:
        store: a store that the workers open by the same address.
        broker: redis://...
        listener: called from a thread of its own with every event, one at a time.
        queue_limit: greatest number of cells that wait in the queue.
        interval: seconds between looks at what workers say.
        patience: seconds for which a cell has to be nowhere before it is sent again.
        device: which workers are to bake.
    """

    def __init__(
        self,
        store: Store,
        broker: str,
        listener: Listener | None = None,
        queue_limit: int = 2000,
        interval: float = 0.5,
        patience: float = 5.0,
        device: Device = "cpu",
    ) -> None:
        self._store = store
        self._mail = Mail(broker, device)
        self._board = Board(broker)
        self._listener = listener
        self._queue_limit = queue_limit
        self._interval = interval
        self._patience = patience
        self._jobs: dict[str, Job] = {}
        self._blame = Blame()
        #: cells that were sent, and since when they are nowhere to be seen
        self._sent: dict[tuple[str, str], float | None] = {}
        self._slots: list[Slot] = []
        self._aside: dict[str, str] = {}
        self._next_list: dict[str, float] = {}
        self._next_peek = 0.0
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
        control.forget_attempts(self._store, bake)
        job = Job(self._store, bake, hold=True)
        with self._changed:
            self._blame.forget(bake)
            self._jobs[bake] = job
            self._forget_sent(bake)
            self._next_list[bake] = time.monotonic() + _LIST
            self._told.pop(bake, None)
            self._wake()
        self._without_redis(lambda: self._board.allow(bake))

    def first(self, bake: str, cells: Iterable[str]) -> None:
        """Bake these cells before all others; the first named comes first."""
        with self._changed:
            job = self._job(bake)
            # What a process bakes already needs no hurry.
            under_way = {slot.cell for slot in self._slots if slot.bake == bake}
            wanted = [cell for cell in dict.fromkeys(cells) if cell not in under_way]
            # What was put first before gives way, and what waits in the long queue is sent again.
            self._withdraw(job, urgent=True)
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
                if not self._without_redis(partial(self._send, job, near, urgent=True)):
                    break

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
        """Stop at once; what is done stays, and `submit` takes the bake up again."""
        self._stop(bake, "cancelled")
        self._without_redis(lambda: self._board.cancel([bake]))

    def retry(self, bake: str) -> None:
        """Try failed cells anew."""
        control.forget_attempts(self._store, bake)
        with self._changed:
            self._blame.forget(bake)
            self._job(bake).retry()
            self._wake()

    def status(self, bake: str) -> BakeStatus:
        """Where a bake stands; raises NotFoundError for one never submitted."""
        # without the lock: numbers may be a moment apart, but nobody waits for the feeder
        return self._job(bake).status()

    def wait(self, bake: str, timeout: float | None = None) -> BakeStatus:
        """Wait until a bake has ended, or for `timeout` seconds."""
        with self._changed:
            job = self._job(bake)
            self._changed.wait_for(lambda: job.state in ENDED, timeout)
            return job.status()

    def slots(self) -> list[Slot]:
        """Processes of living workers, as of the last look."""
        with self._changed:
            return list(self._slots)

    def aside(self) -> dict[str, str]:
        """Living workers that were set aside, and why."""
        with self._changed:
            return dict(self._aside)

    def left(self) -> int:
        """Cells that are still to be baked of all bakes that may go on."""
        with self._changed:
            jobs = [job for job in self._jobs.values() if job.state in ("queued", "running")]
            return sum(job.left for job in jobs)

    def wanted(self) -> int:
        """Workers that the cells still to be baked are worth."""
        return wanted_workers(self.left(), self.slots())

    def close(self) -> None:
        """Feed the farm no more; workers finish what is in the queue."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        self._mail.close()
        self._board.close()

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
            for urgent in (False, True):
                self._withdraw(job, urgent)
            self._wake()

    def _withdraw(self, job: Job, urgent: bool) -> None:
        """Take a bake's cells out of a queue; they wait here again, in the same order."""

        def withdraw() -> None:
            for cell in reversed(self._mail.withdraw(job.bake, urgent)):
                self._put_back(job, cell)

        self._without_redis(withdraw)

    @staticmethod
    def _without_redis(call: Callable[[], None]) -> bool:
        """Do something that the farm gets over if Redis is gone; whether it worked."""
        try:
            call()
        except _REDIS_ERRORS as error:
            log.warning("Redis does not answer, going on without: %s", error)
            return False
        return True

    def _run(self) -> None:
        """The feeder: hear what workers say, look into the store, send what is missing, tell."""
        steps: tuple[Callable[[], None], ...] = (
            self._hear,
            self._list,
            self._meet,
            self._feed,
            self._tell,
        )
        while True:
            for step in steps:
                try:
                    step()
                except _REDIS_ERRORS as error:
                    log.warning("Redis does not answer, trying on: %s", error)
                except FarfieldError as error:
                    log.warning("the store does not answer, trying on: %s", error)
                except Exception:  # whatever it is, the farm goes on
                    log.exception("the feeder stumbled, trying on")
            with self._changed:
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._closed or self._hurry, self._interval)
                self._hurry = False
                if self._closed:
                    return

    def _wake(self) -> None:
        """Let the feeder look at once."""
        self._hurry = True
        self._changed.notify_all()

    def _under_way(self) -> list[Job]:
        with self._changed:
            return [job for job in self._jobs.values() if job.running or job.state not in ENDED]

    def _hear(self) -> None:
        """Take in what workers say of their cells."""
        for job in self._under_way():
            for report in self._board.reports(job.bake):
                with self._changed:
                    if report.attempt:
                        attempt = control.Attempt(worker=report.worker, reason=report.reason)
                        self._tried(job, report.cell, report.attempt, attempt)
                    else:
                        self._baked(job, [report.cell], report)

    def _list(self) -> None:
        """Take in what the store says, where it is time or a bake seems to be done."""
        for job in self._under_way():
            started = time.monotonic()
            with self._changed:
                ends = job.left == 0
                if not ends and started < self._next_list.get(job.bake, 0):
                    continue
                before = job.snapshot()
                known = self._blame.names(job.bake)
            attempts = list(control.read_attempts(self._store, job.bake, known))
            seen = job.listed(done_names(self._store, job.bake))
            with self._changed:
                for cell, name, attempt in attempts:
                    self._tried(job, cell, name, attempt)
                rows = job.confirm(seen, before)
            # in small portions, so that nobody who asks has to wait
            for first in range(0, len(rows), _PORTION):
                with self._changed:
                    self._done(job, job.found_rows(rows[first : first + _PORTION]))
                self._tell_events()
            with self._changed:
                job.let_end()
                now = time.monotonic()
                self._next_list[job.bake] = now + max(_LIST, _LIST_SHARE * (now - started))

    def _baked(self, job: Job, cells: list[str], report: Report) -> None:
        for worker in self._blame.baked(job.bake, report.cell, report.worker):
            reason = "Other workers baked cells that this one could not."
            self._board.set_aside(worker, reason)
            log.warning("worker %s was set aside: %s", worker, reason)
        self._done(job, job.found(cells), report.figures)

    def _done(
        self, job: Job, cells: Iterable[str], figures: dict[str, float] | None = None
    ) -> None:
        for cell in cells:
            self._sent.pop((job.bake, cell), None)
            self._events.append(Event(job.bake, "done", job.state, cell, figures or {}))

    def _tried(self, job: Job, cell: str, name: str, attempt: control.Attempt) -> None:
        """An attempt at a cell went wrong: try it again, by another worker, or give it up."""
        if not self._blame.add(job.bake, cell, name, attempt) or cell not in job.running:
            return
        self._sent.pop((job.bake, cell), None)
        live = {slot.worker for slot in self._slots} - set(self._aside)
        verdict = self._blame.verdict(job.bake, cell, live)
        if verdict is None:
            job.again(cell)
            event = Event(job.bake, "retried", job.state, cell, reason=attempt.reason)
        else:
            job.fail(cell, verdict)
            event = Event(job.bake, "failed", job.state, cell, reason=verdict)
        self._events.append(event)

    def _meet(self) -> None:
        """See who lives, and which cells are lost."""
        slots, aside = self._board.slots(), self._board.aside()
        live = {slot.worker for slot in slots}
        waiting = self._mail.waiting()
        now = time.monotonic()
        queued: set[tuple[str, str]] | None = set()
        if waiting.urgent or waiting.others:
            queued = self._mail.peek() if now >= self._next_peek else None
        if queued:
            self._next_peek = time.monotonic() + _PEEK
        with self._changed:
            self._slots = slots
            self._aside = {worker: why for worker, why in aside.items() if worker in live}
            idle = bool(live) and live == set(self._aside)
            for job in self._jobs.values():
                if job.state in ("queued", "running"):
                    why = next(iter(self._aside.values()), "")
                    job.reason = f"All workers were set aside. {why}" if idle else None
            if queued is None:
                return
            baking = {(slot.bake, slot.cell) for slot in slots}
            for key, since in list(self._sent.items()):
                if key in queued or key in baking:
                    self._sent[key] = None
                elif since is None:
                    self._sent[key] = now
                elif now - since >= self._patience:
                    self._put_back(self._jobs[key[0]], key[1])

    def _feed(self) -> None:
        """Fill the queue up to its limit."""
        room = self._queue_limit - self._mail.waiting().others
        while room > 0 and not self._closed:
            # in small portions, so that nobody who asks has to wait
            with self._changed:
                portion = self._portion(min(room, _SENT_AT_ONCE))
                try:
                    for job, cell in portion:
                        self._send(job, cell)
                finally:  # what was taken and not sent, because Redis is gone, waits again
                    for job, cell in portion:
                        if (job.bake, cell) not in self._sent:
                            self._put_back(job, cell)
            room -= len(portion)
            if not portion:
                return

    def _portion(self, size: int) -> list[tuple[Job, str]]:
        """Up to so many cells to send next."""
        found: list[tuple[Job, str]] = []
        for job in self._jobs.values():
            while len(found) < size and (cell := job.take()) is not None:
                found.append((job, cell))
        return found

    def _send(self, job: Job, cell: str, urgent: bool = False) -> None:
        # those that failed it leave it to others, if there are any when it comes to them
        avoid = sorted(self._blame.workers(job.bake, cell))
        try:
            self._mail.send(job.bake, cell, avoid, urgent=urgent)
        except BaseException:
            job.put_back(cell)
            raise
        self._sent[job.bake, cell] = None

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
        self._tell_events()

    def _tell_events(self) -> None:
        while self._events:
            event = self._events.popleft()
            if self._listener is not None:
                self._listener(event)
