"""Baking on this machine: spawned processes, each with one cell under way.

A process that dies, hangs or speaks nonsense thus blames exactly its cell, which is tried again in
a fresh process. What is done is what the store lists: an answer alone does not count.
"""

from __future__ import annotations

import logging
import os
import threading
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

from farfield_core import layout
from farfield_core.cells import parse_cell_name
from farfield_core.dispatch import ENDED, BakeStatus, Event, Listener
from farfield_core.dispatch.executor import COMMAND, CellError, Executor, ExecutorError
from farfield_core.dispatch.jobs import Job
from farfield_core.errors import BadInputError, FarfieldError, NotFoundError
from farfield_core.store import Store

log = logging.getLogger(__name__)

#: starts in a row that may fail before a bake is given up
STARTS = 3


class LocalDispatcher:
    """Bakes in `jobs` processes at a time; bakes are served in the order of their submission.

    Args:
        store: a store that other processes can open.
        jobs: number of processes; the number of cores unless given.
        listener: called from worker threads with every event, one at a time.
        command: how to start an executor (`farfield_core.dispatch.executor`).
        environment: variables for the executors, beside this process's own.
        cell_timeout: seconds after which a cell counts as hung.
        start_timeout: seconds in which an executor has to become ready.
    """

    def __init__(
        self,
        store: Store,
        jobs: int | None = None,
        listener: Listener | None = None,
        command: Sequence[str] = COMMAND,
        environment: Mapping[str, str] | None = None,
        cell_timeout: float = 900.0,
        start_timeout: float = 300.0,
    ) -> None:
        if store.url == "memory://":
            raise BadInputError("A store in memory cannot be shared with processes; use a folder.")
        self._store = store
        self._listener = listener
        self._command = tuple(command)
        self._environment = {**os.environ, **(environment or {})}
        self._cell_timeout = cell_timeout
        self._start_timeout = start_timeout
        self._jobs: dict[str, Job] = {}
        self._executors: dict[int, Executor] = {}
        self._bad_starts: dict[str, int] = {}
        self._closed = False
        self._changed = threading.Condition()
        self._events: deque[Event] = deque()
        self._telling = threading.Lock()
        count = jobs if jobs is not None else (os.cpu_count() or 1)
        if count < 1:
            raise BadInputError("Baking needs at least one process; use --jobs 1 or more.")
        self._threads = [
            threading.Thread(target=self._serve, args=(slot,), name=f"farfield-slot-{slot}")
            for slot in range(count)
        ]
        for thread in self._threads:
            thread.daemon = True
            thread.start()

    def submit(self, bake: str) -> None:
        """Bake every missing cell of a bake; nothing happens if that is under way."""
        with self._changed:
            job = self._jobs.get(bake)
            if job is not None and job.state not in ENDED:
                return
        job = Job(self._store, bake)
        with self._changed:
            self._jobs[bake] = job
            self._bad_starts.pop(bake, None)
            self._note(job, "state")
            self._changed.notify_all()
        self._tell()

    def first(self, bake: str, cells: Iterable[str]) -> None:
        """Bake these cells before all others; the first named comes first."""
        with self._changed:
            job = self._jobs.pop(bake, None)
            if job is None:
                raise _unknown(bake)
            # its bake comes before the others, too
            self._jobs = {bake: job, **self._jobs}
            job.first(cells)

    def pause(self, bake: str) -> None:
        """Begin no more cells; those under way are finished."""
        with self._changed:
            job = self._job(bake)
            if job.state not in ENDED:
                job.state = "paused"
            self._note(job, "state")
            self._changed.notify_all()
        self._tell()

    def resume(self, bake: str) -> None:
        """Go on with a paused bake."""
        with self._changed:
            job = self._job(bake)
            if job.state == "paused":
                job.state = "queued"
            self._note(job, "state")
            self._changed.notify_all()
        self._tell()

    def cancel(self, bake: str) -> None:
        """Stop at once; what is done stays, and `submit` takes the bake up again."""
        with self._changed:
            job = self._job(bake)
            if job.state not in ENDED:
                job.state = "cancelled"
            for executor in self._executors.values():
                if executor.bake == bake:
                    executor.kill()
            self._note(job, "state")
            self._changed.notify_all()
        self._tell()

    def retry(self, bake: str) -> None:
        """Try failed cells anew."""
        with self._changed:
            job = self._job(bake)
            job.retry()
            self._bad_starts.pop(bake, None)
            self._note(job, "state")
            self._changed.notify_all()
        self._tell()

    def status(self, bake: str) -> BakeStatus:
        """Where a bake stands; raises NotFoundError for one never submitted."""
        with self._changed:
            return self._job(bake).status()

    def wait(self, bake: str, timeout: float | None = None) -> BakeStatus:
        """Wait until a bake has ended, or for `timeout` seconds."""
        with self._changed:
            job = self._job(bake)
            self._changed.wait_for(lambda: job.state in ENDED and not job.running, timeout)
            return job.status()

    def close(self) -> None:
        """Stop all work at once and free everything."""
        with self._changed:
            self._closed = True
            for executor in self._executors.values():
                executor.kill()
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()

    def __enter__(self) -> LocalDispatcher:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _job(self, bake: str) -> Job:
        try:
            return self._jobs[bake]
        except KeyError:
            raise _unknown(bake) from None

    def _note(
        self,
        job: Job,
        kind: Literal["state", "started", "done", "retried", "failed"],
        cell: str | None = None,
        figures: Mapping[str, float] | None = None,
        reason: str | None = None,
    ) -> None:
        """Remember an event. The caller holds the lock, so events stand in their true order."""
        if self._listener is not None:
            event = Event(job.bake, kind, job.state, cell, dict(figures or {}), reason)
            self._events.append(event)

    def _tell(self) -> None:
        """Tell of what was noted, one at a time and in order; the caller holds no lock."""
        with self._telling:
            while self._events:
                event = self._events.popleft()
                assert self._listener
                try:
                    self._listener(event)
                except Exception:  # a listener's fault must not end the baking
                    log.exception("A listener failed on %s of bake %s.", event.kind, event.bake)

    def _serve(self, slot: int) -> None:
        """One slot: take a cell, bake it in this slot's process, tell what became of it."""
        try:
            while (task := self._next(slot)) is not None:
                self._bake(slot, *task)
        finally:
            self._drop(slot)

    def _next(self, slot: int) -> tuple[Job, str] | None:
        """Wait for a cell to bake; None when the dispatcher is closed."""
        with self._changed:
            while not self._closed:
                for job in self._jobs.values():
                    cell = job.take()
                    if cell is not None:
                        return job, cell
                # an idle process only holds memory
                self._drop(slot)
                self._changed.wait()
        return None

    def _bake(self, slot: int, job: Job, cell: str) -> None:
        try:
            executor = self._executor(slot, job)
        except ExecutorError as error:
            self._bad_start(slot, job, cell, str(error))
            return
        with self._changed:
            self._note(job, "started", cell)
        self._tell()
        figures: dict[str, float] = {}
        reason = f"Cell {cell} was not found in the store after it was baked."
        try:
            figures = executor.bake_cell(cell, self._cell_timeout)
        except CellError as error:
            reason = str(error)
        except ExecutorError as error:
            reason = str(error)
            self._drop(slot)
        try:
            # a process may die after its cell was written
            exists = self._store.exists(layout.cell_key(job.bake, parse_cell_name(cell)))
        except FarfieldError as error:
            exists, reason = False, str(error)
        with self._changed:
            before = job.state
            stopped = self._closed or before == "cancelled"
            again = False
            if exists:
                job.done(cell)
            elif stopped:
                job.put_back(cell)
            else:
                again = job.stumbled(cell, reason)
            if exists:
                self._note(job, "done", cell, figures)
            elif not stopped:
                self._note(job, "retried" if again else "failed", cell, reason=reason)
            if job.state != before and job.state in ENDED:
                self._note(job, "state")
            self._changed.notify_all()
        if not exists and not stopped:
            self._drop(slot)  # the next attempt gets a fresh process
        self._tell()

    def _executor(self, slot: int, job: Job) -> Executor:
        """This slot's process for the job's bake, started if need be; raises ExecutorError."""
        executor = self._executors.get(slot)
        if executor is not None and executor.bake != job.bake:
            self._drop(slot)
            executor = None
        if executor is None:
            try:
                executor = Executor(self._store.url, job.bake, self._command, self._environment)
            except OSError as error:
                raise ExecutorError(f"The process could not be started: {error}.") from None
            with self._changed:
                self._executors[slot] = executor
                if self._closed or job.state == "cancelled":
                    executor.kill()
        executor.wait_ready(self._start_timeout)
        self._bad_starts.pop(job.bake, None)
        return executor

    def _bad_start(self, slot: int, job: Job, cell: str, reason: str) -> None:
        """A process did not come up: no cell is to blame, but it may never come up."""
        self._drop(slot)
        with self._changed:
            job.put_back(cell)
            if self._closed or job.state == "cancelled":
                self._changed.notify_all()
                return
            self._bad_starts[job.bake] = self._bad_starts.get(job.bake, 0) + 1
            given_up = self._bad_starts[job.bake] >= STARTS and job.state not in ENDED
            if given_up:
                job.give_up(f"Baking could not begin. {reason}")
                self._note(job, "state", reason=reason)
            self._changed.notify_all()
        self._tell()

    def _drop(self, slot: int) -> None:
        with self._changed:
            executor = self._executors.pop(slot, None)
        if executor is not None:
            executor.close()


def _unknown(bake: str) -> NotFoundError:
    return NotFoundError(f"There is no bake {bake} under way.")
