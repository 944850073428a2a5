"""What is left to do of one bake: cells waiting, under way, tried and failed. No processes here.

A bake of a million cells has to fit: a cell is a row of a table and its state a byte, and only what
is under way, tried or failed has an entry of its own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from farfield_core.bake import done_names, read_walk
from farfield_core.dispatch import BakeStatus, State
from farfield_core.dispatch.rows import CellRows
from farfield_core.store import Store
from farfield_core.tables import walk_grid

#: how often a cell is tried before it has failed
ATTEMPTS = 3

_WAITING, _RUNNING, _DONE, _FAILED = range(4)


class Job:
    """The cells of one bake. Not thread-safe: its owner holds a lock.

    Attributes:
        state: see BakeStatus.
        reason: why the bake as a whole cannot go on, or does not.
        running: cells under way.
        failed: why each failed cell failed.
        hold: whether the bake does not end before `let_end`.
    """

    def __init__(self, store: Store, bake: str, hold: bool = False) -> None:
        walk = read_walk(store, bake)
        self._rows = CellRows(walk_grid(store, walk).index)
        self._states = np.full(len(self._rows), _WAITING, np.uint8)
        self.bake = bake
        self.total = len(self._rows)
        self.reason: str | None = None
        self.running: set[str] = set()
        self.failed: dict[str, str] = {}
        self._attempts: dict[str, int] = {}
        # Waiting rows are taken from the front, then in order, then from the back. A row may stand
        # in several places: its state tells whether it still waits.
        self._front: deque[int] = deque()
        self._next = 0
        self._back: deque[int] = deque()
        self._open = self.total  # neither done nor failed
        self.state: State = "queued"
        self.hold = hold
        there = self.listed(done_names(store, bake))
        self._states[there] = _DONE
        self._open -= int(there.sum())
        self._settle()

    def first(self, cells: Iterable[str]) -> None:
        """Move waiting cells to the front."""
        rows = [row for row in self._known(cells) if self._states[row] == _WAITING]
        self._front.extendleft(reversed(rows))

    def take(self) -> str | None:
        """The next cell to bake, if the bake may go on and one waits."""
        if self.state not in ("queued", "running"):
            return None
        row = self._take_row()
        if row is None:
            return None
        self.state = "running"
        self._states[row] = _RUNNING
        cell = self._rows.name(row)
        self.running.add(cell)
        return cell

    def done(self, cell: str) -> None:
        """A cell exists."""
        self.running.discard(cell)
        self._end(cell, _DONE)

    def found(self, cells: Iterable[str]) -> list[str]:
        """These cells exist; returns those of which that was not known."""
        rows = self._rows.find(cells)
        return self.found_rows(rows[rows >= 0])

    def found_rows(self, rows: NDArray[np.int64]) -> list[str]:
        """The same for rows of cells, (n,) int64."""
        fresh = np.unique(rows[self._states[rows] != _DONE])
        names = [self._rows.name(row) for row in fresh.tolist()]
        for name in names:
            if self.failed.pop(name, None) is not None:
                self._open += 1
        self._states[fresh] = _DONE
        self._open -= len(fresh)
        self.running.difference_update(names)
        self._settle()
        return names

    def snapshot(self) -> NDArray[np.bool_]:
        """Cells known to exist, (total,) bool; for `confirm`."""
        return np.asarray(self._states == _DONE)

    def listed(self, cells: Iterable[str]) -> NDArray[np.bool_]:
        """Cells by row, (total,) bool. Safe to call without the lock, as it may take long."""
        seen, names = np.zeros(self.total, np.bool_), iter(cells)
        while batch := list(islice(names, 4096)):
            rows = self._rows.find(batch)
            seen[rows[rows >= 0]] = True
        return seen

    def confirm(self, seen: NDArray[np.bool_], before: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The store lists the cells `seen`; returns rows of those of which that is not known.

        `before` is the snapshot from when listing began: what it holds and the list does not is
        gone and waits again.
        """
        gone = np.flatnonzero(before & ~seen & (self._states == _DONE))
        self._states[gone] = _WAITING
        self._front.extend(gone.tolist())
        self._open += len(gone)
        return np.flatnonzero(seen & (self._states != _DONE))

    def let_end(self) -> None:
        """The bake ends now if nothing is left: the store lists what is said to be done."""
        hold, self.hold = self.hold, False
        self._settle()
        self.hold = hold

    def put_back(self, cell: str) -> None:
        """A cell was not finished, through no fault of its own."""
        self._wait(cell, first=True)

    def again(self, cell: str) -> None:
        """Somebody else, who counts attempts, has a cell tried again, after all that wait."""
        self._wait(cell, first=False)

    def stumbled(self, cell: str, reason: str) -> bool:
        """A cell went wrong; returns whether it will be tried again."""
        self._attempts[cell] = self._attempts.get(cell, 0) + 1
        again = self._attempts[cell] < ATTEMPTS
        if again:
            self._wait(cell, first=False)
        else:
            self.fail(cell, f"{reason} (tried {self._attempts[cell]} times)")
        return again

    def fail(self, cell: str, reason: str) -> None:
        """A cell is given up."""
        self.running.discard(cell)
        self.failed[cell] = reason
        self._end(cell, _FAILED)

    def give_up(self, reason: str) -> None:
        """The bake as a whole cannot go on."""
        self.state, self.reason = "failed", reason

    def retry(self) -> None:
        """Failed cells wait again."""
        for cell in self.failed:
            self._attempts.pop(cell, None)
            self._wait(cell, first=False)
        self._open += len(self.failed)
        self.failed = {}
        self.reason = None
        if self._open and self.state == "failed":
            self.state = "queued"

    @property
    def left(self) -> int:
        """Cells neither done nor failed."""
        return self._open

    def status(self) -> BakeStatus:
        """Where the bake stands."""
        return BakeStatus(
            state=self.state,
            total=self.total,
            done=self.total - self._open - len(self.failed),
            failed=len(self.failed),
            running=len(self.running),
            reasons=dict(self.failed),
            reason=self.reason,
        )

    def _known(self, cells: Iterable[str]) -> list[int]:
        return [row for row in self._rows.find(dict.fromkeys(cells)).tolist() if row >= 0]

    def _wait(self, cell: str, *, first: bool) -> None:
        self.running.discard(cell)
        for row in self._known([cell]):
            if self._states[row] in (_RUNNING, _FAILED):
                self._states[row] = _WAITING
                if first:
                    self._front.appendleft(row)
                else:
                    self._back.append(row)

    def _take_row(self) -> int | None:
        while self._front:
            if self._states[row := self._front.popleft()] == _WAITING:
                return row
        while self._next < self.total:
            self._next += 1
            if self._states[self._next - 1] == _WAITING:
                return self._next - 1
        while self._back:
            if self._states[row := self._back.popleft()] == _WAITING:
                return row
        return None

    def _end(self, cell: str, state: int) -> None:
        for row in self._known([cell]):
            if self._states[row] in (_WAITING, _RUNNING):
                self._open -= 1
            self._states[row] = state
        self._settle()

    def _settle(self) -> None:
        if not self._open and not self.hold and self.state != "cancelled":
            self.state = "failed" if self.failed else "done"
