"""A pool process's signs of life, and the orders it gets in return.

A thread of its own gives them, so that a cell that takes long, or hangs, does not make its process
look lost. Losing Redis for a while only means that nobody hears.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace

from farfield_core.dispatch.board import BEAT, Board, Orders, Report
from farfield_core.dispatch.slots import Slot
from redis.exceptions import RedisError

log = logging.getLogger(__name__)

#: seconds over which the rate is measured
_WINDOW = 300.0


class Heartbeat:
    """Tells of one process.

    Args:
        board: where to tell.
        slot: who the process is.
        drop: called from the thread when the cell under way is to be dropped.
        megabytes: memory of what bakes, now.
    """

    def __init__(
        self,
        board: Board,
        slot: Slot,
        drop: Callable[[], None],
        megabytes: Callable[[], float],
    ) -> None:
        self._board = board
        self._slot = slot
        self._drop = drop
        self._megabytes = megabytes
        self._times: deque[float] = deque(maxlen=1000)
        self._lock = threading.Lock()
        self._orders = Orders(cancelled=False, aside=False)
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="farfield-heartbeat", daemon=True)
        self._thread.start()

    @property
    def worker(self) -> str:
        """Name of the worker that this process belongs to."""
        return self._slot.worker

    @property
    def orders(self) -> Orders:
        """The last orders that came; `cancelled` is about the cell under way."""
        return self._orders

    def begin(self, bake: str, cell: str) -> bool:
        """A cell is under way from now on; False, and it is not, if another process bakes it."""
        slot = replace(self._slot, bake=bake, cell=cell)
        with contextlib.suppress(RedisError, OSError):
            if not self._board.claim(slot):
                return False
        with self._lock:
            self._slot = slot
            self._orders = replace(self._orders, cancelled=False)
        self._beat()
        return True

    def end(self, renderer: str, *, done: bool = False, tried: bool = False) -> None:
        """The cell under way is no longer."""
        if done:
            self._times.append(time.monotonic())
        with contextlib.suppress(RedisError, OSError):
            self._board.release(self._slot)
        with self._lock:
            self._slot = replace(
                self._slot,
                bake="",
                cell="",
                renderer=renderer or self._slot.renderer,
                done=self._slot.done + done,
                tried=self._slot.tried + tried,
            )
        if self._orders.cancelled:  # somebody waits to see it end
            self._beat()

    def report(self, bake: str, report: Report) -> None:
        """Tell what became of a cell; if nobody hears, the store will tell."""
        with contextlib.suppress(RedisError, OSError):
            self._board.report(bake, report)

    def close(self) -> None:
        """Say that the process ends."""
        self._closed.set()
        self._thread.join()
        with contextlib.suppress(RedisError, OSError):
            self._board.leave(self._slot)

    def _run(self) -> None:
        # at once: whoever decides by who lives must not overlook a fresh worker
        self._beat()
        while not self._closed.wait(BEAT):
            self._beat()

    def _beat(self) -> None:
        with self._lock:
            now = time.monotonic()
            recent = [at for at in self._times if now - at < _WINDOW]
            span = now - recent[0] if recent else 0.0
            rate = (len(recent) - 1) / span if len(recent) > 1 and span > 0 else 0.0
            slot = replace(self._slot, rate=round(rate, 4), megabytes=round(self._megabytes(), 1))
            try:
                self._orders = self._board.beat(slot)
            except (RedisError, OSError) as error:
                log.debug("nobody hears this process: %s", error)
                return
            cancelled = self._orders.cancelled
        if cancelled:
            self._drop()
