"""What a pool process does with a cell that it is handed: bake it, and say what became of it.

Three may be to blame when that goes wrong. A cell is: then the attempt is written down. The store,
or Redis: then nothing is, and the feeder sends the cell again when it finds it lost. The machine,
on which no baking process comes up: then the worker sets itself aside.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Sequence

from farfield_core import layout
from farfield_core.cells import parse_cell_name
from farfield_core.control import Attempt, read_control, write_attempt
from farfield_core.dispatch.board import Board, Report
from farfield_core.dispatch.executor import CellError, ExecutorError, StoreFaultError
from farfield_core.dispatch.local import STARTS
from farfield_core.errors import FarfieldError
from farfield_core.store import Store
from redis.exceptions import RedisError

from farfield_worker.farm.bakers import Baker, StartError
from farfield_worker.farm.heartbeat import Heartbeat

log = logging.getLogger(__name__)

#: seconds of rest after the store failed
_STORE_REST = 2.0
#: seconds for which what is wanted of a bake is believed without asking again
_CONTROL_AGE = 1.0


class Desk:
    """One pool process at work."""

    def __init__(self, store: Store, baker: Baker, board: Board, heartbeat: Heartbeat) -> None:
        self.store = store
        self.baker = baker
        self._board = board
        self.heartbeat = heartbeat
        self._bad_starts = 0
        self._wanted: tuple[str, str | None, float] = ("", None, 0.0)

    def bake(
        self, bake: str, cell: str, avoid: Sequence[str], hand_over: Callable[[], None]
    ) -> None:
        """Bake a cell, or `hand_over` to another worker what this one is not to bake."""
        if self.heartbeat.orders.aside or self._leaves_to_others(avoid):
            time.sleep(0.5)  # or it would come straight back
            hand_over()
            return
        try:
            if self._is_wanted(bake) and self.heartbeat.begin(bake, cell):
                self._bake(bake, cell)
        except (FarfieldError, StoreFaultError) as error:
            log.warning("the store failed, cell %s of %s has to wait: %s", cell, bake, error)
            time.sleep(_STORE_REST)

    def _leaves_to_others(self, avoid: Sequence[str]) -> bool:
        """Whether a cell is to be avoided here, and somebody lives who may bake it."""
        if self.heartbeat.worker not in avoid:
            return False
        try:
            live = {slot.worker for slot in self._board.slots()}
            return bool(live - set(avoid) - set(self._board.aside()))
        except (RedisError, OSError):
            return True

    def _bake(self, bake: str, cell: str) -> None:
        key = layout.cell_key(bake, parse_cell_name(cell))
        done, reason, figures = False, "", {}
        try:
            if not (done := self.store.exists(key)):
                try:
                    figures = self.baker.bake_cell(bake, cell)
                    reason = f"Cell {cell} was not found in the store after it was baked."
                except (CellError, ExecutorError) as error:
                    reason = str(error)
                self._bad_starts = 0
                # a process may die after its cell was written
                done = self.store.exists(key)
            if done:
                self._report(bake, Report(cell, self.heartbeat.worker, figures))
            elif not self.heartbeat.orders.cancelled:
                self.baker.close()  # the next attempt gets a fresh process
                self.tried(bake, cell, reason)
        except StartError as error:
            self._bad_start(str(error))
        finally:
            self.heartbeat.end(self.baker.renderer, done=done, tried=bool(reason) and not done)

    def tried(self, bake: str, cell: str, reason: str) -> None:
        """Write down that a cell was tried in vain."""
        attempt = Attempt(worker=self.heartbeat.worker, reason=reason)
        name = write_attempt(self.store, bake, cell, attempt)
        self._report(bake, Report(cell, attempt.worker, reason=reason, attempt=name))

    def _report(self, bake: str, report: Report) -> None:
        self.heartbeat.report(bake, report)

    def _is_wanted(self, bake: str) -> bool:
        known, wanted, until = self._wanted
        now = time.monotonic()
        if known != bake or now > until:
            control = read_control(self.store, bake)
            wanted = control.wanted if control is not None else None
            self._wanted = (bake, wanted, now + _CONTROL_AGE)
        return wanted not in ("paused", "cancelled")

    def _bad_start(self, reason: str) -> None:
        """Baking could not begin here: after a few times, leave it to others."""
        self._bad_starts += 1
        log.warning("no baking process comes up: %s", reason)
        if self._bad_starts >= STARTS:
            with contextlib.suppress(RedisError, OSError):
                self._board.set_aside(self.heartbeat.worker, f"Baking could not begin. {reason}")
        time.sleep(1.0)
