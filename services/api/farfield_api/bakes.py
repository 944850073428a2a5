"""Bakes as a server sees them: what was asked for is kept in the store, a dispatcher does the work.

After a restart, whatever the store says is wanted is taken up again. A bake that this server does
not run, such as one of the command line in the same store, is watched through its files.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from farfield_core.bake import done_cells, read_walk
from farfield_core.cells import CellGrid, Index, cell_name
from farfield_core.control import Control, read_control, write_control
from farfield_core.dispatch import BakeStatus, Dispatcher, Event, Listener
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.store import Store
from farfield_core.tables import walk_grid
from farfield_core.walk import Walk

from farfield_api.exceptions import NotNowError

log = logging.getLogger(__name__)

#: cells around a walker that are moved to the front
NEARBY = 256
#: cells in a page of those that exist
PAGE = 1000
#: seconds between looks into the store for a bake that others run, and between hints passed on
PATIENCE = 0.5
#: seconds over which the rate is measured
WINDOW = 60.0


@dataclass
class _Seen:
    """What this server knows of one bake.

    Attributes:
        done: cells that exist, in the order in which they were seen; only ever appended to.
        times: when cells were done, by this server's clock, over the last minute.
        hints: cells that viewers asked for and did not get.
    """

    done: list[str] = field(default_factory=list)
    known: set[str] = field(default_factory=set)
    times: deque[float] = field(default_factory=deque)
    hints: OrderedDict[str, None] = field(default_factory=OrderedDict)
    listed: float = -1e9
    hinted: float = -1e9

    def add(self, cell: str) -> None:
        if cell not in self.known:
            self.known.add(cell)
            self.done.append(cell)


@dataclass(frozen=True)
class Progress:
    """Where a bake stands, and how fast it goes (cells a second, None where nothing moves)."""

    walk: Walk
    status: BakeStatus
    rate: float | None


class Bakes:
    """All bakes of a store.

    Args:
        store: where they are.
        dispatcher: makes the dispatcher, given the listener that it has to tell of its work.
    """

    def __init__(self, store: Store, dispatcher: Callable[[Listener], Dispatcher]) -> None:
        self._store = store
        self._lock = threading.RLock()
        self._seen: dict[str, _Seen] = {}
        self._mine: set[str] = set()
        self._created: dict[str, str] = {}
        self.listeners: list[Listener] = []
        self._dispatcher = dispatcher(self._listen)
        self.walk = lru_cache(maxsize=64)(self._read_walk)
        self._grid: Callable[[str], CellGrid] = lru_cache(maxsize=4)(
            lambda bake: walk_grid(store, self.walk(bake))
        )

    @property
    def dispatcher(self) -> Dispatcher:
        """Who bakes."""
        return self._dispatcher

    def ids(self) -> list[str]:
        """All bakes, those asked for first coming first; those never asked for come last."""
        return [key.rpartition(" ")[2] for key in self.order()]

    def order(self) -> list[str]:
        """All bakes as "<when asked for> <id>", sorted; "~" stands for never."""
        keys = []
        for bake in self._store.folders("bakes/"):
            if bake not in self._created:
                if not self._store.exists(f"bakes/{bake}/walk.json"):
                    continue
                control = read_control(self._store, bake)
                if control is None:
                    keys.append(f"~ {bake}")
                    continue
                self._created[bake] = control.created.isoformat()
            keys.append(f"{self._created[bake]} {bake}")
        return sorted(keys)

    def take_up(self) -> None:
        """Go on with everything that is wanted: what a server does when it starts."""
        for bake in self.ids():
            control = read_control(self._store, bake)
            if control is not None and control.wanted == "running":
                try:
                    self._submit(bake)
                except FarfieldError as error:
                    log.warning("bake %s was not taken up: %s", bake, error)

    def start(self, bake: str) -> None:
        """Have a bake's missing cells baked; nothing happens if that is under way."""
        self.walk(bake)
        if self.progress(bake).status.state == "running":
            return
        write_control(self._store, bake, "running")
        self._submit(bake)

    def progress(self, bake: str) -> Progress:
        """Where a bake stands; raises NotFoundError."""
        walk = self.walk(bake)
        return Progress(walk, self._status(walk), self._rate(bake))

    def pause(self, bake: str) -> None:
        """Begin no more cells; those under way are finished."""
        self._refuse_unless(bake, "pause", "queued", "running", "paused")
        write_control(self._store, bake, "paused")
        if self._runs_here(bake):
            self._dispatcher.pause(bake)

    def resume(self, bake: str) -> None:
        """Go on with a paused or cancelled bake."""
        self._refuse_unless(bake, "resume", "queued", "running", "paused", "cancelled")
        write_control(self._store, bake, "running")
        if self._runs_here(bake) and self._dispatcher.status(bake).state == "paused":
            self._dispatcher.resume(bake)
        else:
            self._submit(bake)

    def cancel(self, bake: str) -> None:
        """Stop at once; what is done stays."""
        self._refuse_unless(bake, "cancel", "queued", "running", "paused", "cancelled", "failed")
        write_control(self._store, bake, "cancelled")
        if self._runs_here(bake):
            self._dispatcher.cancel(bake)

    def retry(self, bake: str) -> None:
        """Try failed cells anew; raises NotNowError where none failed."""
        status = self.progress(bake).status
        if not status.failed and status.state != "failed":
            raise NotNowError(f"No cell of bake {bake} has failed; there is nothing to retry.")
        write_control(self._store, bake, "running")
        if self._runs_here(bake):
            self._dispatcher.retry(bake)
        else:
            self._submit(bake)

    def focus(self, bake: str, index: Index) -> None:
        """A walker stands in a cell: bake what is near first. Raises NotFoundError."""
        grid = self._grid(bake)
        centre = grid.centre(index)
        if not self._runs_here(bake):
            return
        distance = ((grid.centres() - centre) ** 2).sum(axis=1)
        count = min(NEARBY, len(grid))
        rows = np.argpartition(distance, count - 1)[:count]
        rows = rows[np.argsort(distance[rows], kind="stable")]
        names = [cell_name((int(i), int(j), int(k))) for i, j, k in grid.index[rows]]
        self._dispatcher.first(bake, names)

    def hint(self, bake: str, index: Index) -> None:
        """A viewer asked for a cell and did not get it; raises NotFoundError for no such bake."""
        if not self._runs_here(bake):
            self.walk(bake)
            return
        with self._lock:
            seen = self._look(bake)
            seen.hints[cell_name(index)] = None
            now = time.monotonic()
            if now - seen.hinted < PATIENCE:
                return
            seen.hinted = now
            names = list(seen.hints)[-NEARBY:]
            seen.hints.clear()
        self._dispatcher.first(bake, names)

    def done_since(self, bake: str, cursor: int) -> list[str]:
        """Cells that exist, in the order in which this server saw them, without the first."""
        self._catch_up(bake)
        with self._lock:
            return self._look(bake).done[cursor:]

    def done_page(self, bake: str, start: int) -> tuple[list[str], int | None]:
        """Up to `PAGE` cells that exist, and where the next page starts."""
        self._catch_up(bake)
        with self._lock:
            done = self._look(bake).done
            end = min(start + PAGE, len(done))
            return done[start:end], end if end < len(done) else None

    def close(self) -> None:
        """Stop all work."""
        self._dispatcher.close()

    def _read_walk(self, bake: str) -> Walk:
        try:
            return read_walk(self._store, bake)
        except NotFoundError:
            raise NotFoundError(
                f"There is no bake {bake}; GET /api/v1/bakes lists those there are."
            ) from None

    def _runs_here(self, bake: str) -> bool:
        with self._lock:
            return bake in self._mine

    def _submit(self, bake: str) -> None:
        with self._lock:
            self._look(bake)
            self._mine.add(bake)
        try:
            self._dispatcher.submit(bake)
        except BaseException:
            with self._lock:
                self._mine.discard(bake)
            raise

    def _refuse_unless(self, bake: str, verb: str, *states: str) -> None:
        state = self.progress(bake).status.state
        if state not in states:
            raise NotNowError(f"Bake {bake} is {state}; there is nothing to {verb}.")

    def _status(self, walk: Walk) -> BakeStatus:
        if self._runs_here(walk.id):
            # it may be on its way to the dispatcher
            with contextlib.suppress(NotFoundError):
                return self._dispatcher.status(walk.id)
        return self._watched(walk)

    def _watched(self, walk: Walk) -> BakeStatus:
        """Status of a bake that this server does not run."""
        control = read_control(self._store, walk.id) or Control()
        with self._lock:
            done = len(self._look(walk.id).done)
        state = "done" if done >= walk.grid.total else control.wanted
        failed = control.reasons if state == "failed" else {}
        return BakeStatus(
            state=state,
            total=walk.grid.total,
            done=done,
            failed=len(failed),
            running=0,
            reasons=failed,
            reason=control.reason if state == "failed" else None,
        )

    def _look(self, bake: str) -> _Seen:
        """What is known of a bake, after a look into the store if others may have changed it."""
        seen = self._seen.setdefault(bake, _Seen())
        now = time.monotonic()
        unseen = seen.listed < 0
        if unseen or (bake not in self._mine and now - seen.listed > PATIENCE):
            for index in sorted(done_cells(self._store, bake)):
                seen.add(cell_name(index))
            seen.listed = time.monotonic()
        return seen

    def _catch_up(self, bake: str) -> None:
        """See to it that a bake that counts as done has all its cells here, whose news may lag."""
        walk = self.walk(bake)
        if self._runs_here(bake) and self._status(walk).state == "done":
            with self._lock:
                seen = self._look(bake)
                if len(seen.done) < walk.grid.total:
                    seen.listed = -1e9

    def _listen(self, event: Event) -> None:
        """Called by the dispatcher with everything that happens."""
        for listener in self.listeners:
            listener(event)
        if event.kind == "done" and event.cell is not None:
            with self._lock:
                seen = self._look(event.bake)
                seen.add(event.cell)
                seen.times.append(time.monotonic())
        elif event.kind == "state" and event.state == "failed":
            status = self._dispatcher.status(event.bake)
            write_control(self._store, event.bake, "failed", status.reasons, status.reason)

    def _rate(self, bake: str) -> float | None:
        with self._lock:
            times = self._seen[bake].times if bake in self._seen else deque()
            now = time.monotonic()
            while times and now - times[0] > WINDOW:
                times.popleft()
            if len(times) < 2:
                return None
            return (len(times) - 1) / max(times[-1] - times[0], 1e-3)
