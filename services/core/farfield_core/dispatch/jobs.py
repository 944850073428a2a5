"""What is left to do of one bake: cells waiting, under way, tried and failed. No processes here."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from farfield_core.bake import missing_cells, read_walk
from farfield_core.cells import cell_name
from farfield_core.dispatch import BakeStatus, State
from farfield_core.store import Store

#: how often a cell is tried before it has failed
ATTEMPTS = 3


class Job:
    """The cells of one bake. Not thread-safe: its owner holds a lock.

    Attributes:
        state: see BakeStatus.
        reason: why the bake as a whole cannot go on.
        running: cells under way.
        failed: why each failed cell failed.
    """

    def __init__(self, store: Store, bake: str) -> None:
        walk = read_walk(store, bake)
        missing = [cell_name(index) for index in missing_cells(store, walk)]
        self.bake = bake
        self.total = walk.grid.total
        self.state: State = "queued" if missing else "done"
        self.reason: str | None = None
        self.running: set[str] = set()
        self.failed: dict[str, str] = {}
        self._waiting = deque(missing)
        self._open = set(missing)  # neither done nor failed
        self._attempts: dict[str, int] = {}

    def first(self, cells: Iterable[str]) -> None:
        """Move waiting cells to the front."""
        wanted = [cell for cell in dict.fromkeys(cells) if cell in self._open - self.running]
        chosen = set(wanted)
        self._waiting = deque([*wanted, *(c for c in self._waiting if c not in chosen)])

    def take(self) -> str | None:
        """The next cell to bake, if the bake may go on and one waits."""
        if self.state not in ("queued", "running") or not self._waiting:
            return None
        self.state = "running"
        cell = self._waiting.popleft()
        self.running.add(cell)
        return cell

    def done(self, cell: str) -> None:
        """A cell exists."""
        self.running.discard(cell)
        self._open.discard(cell)
        self._settle()

    def put_back(self, cell: str) -> None:
        """A cell was not finished, through no fault of its own."""
        self.running.discard(cell)
        self._waiting.appendleft(cell)

    def stumbled(self, cell: str, reason: str) -> bool:
        """A cell went wrong; returns whether it will be tried again."""
        self.running.discard(cell)
        self._attempts[cell] = self._attempts.get(cell, 0) + 1
        again = self._attempts[cell] < ATTEMPTS
        if again:
            self._waiting.append(cell)
        else:
            self.failed[cell] = f"{reason} (tried {self._attempts[cell]} times)"
            self._open.discard(cell)
        self._settle()
        return again

    def fail(self, cell: str, reason: str) -> None:
        """Somebody else, who counts attempts, has given a cell up."""
        self.running.discard(cell)
        self._open.discard(cell)
        self.failed[cell] = reason
        self._settle()

    def give_up(self, reason: str) -> None:
        """The bake as a whole cannot go on."""
        self.state, self.reason = "failed", reason

    def retry(self) -> None:
        """Failed cells wait again."""
        for cell in self.failed:
            self._attempts.pop(cell, None)
            self._open.add(cell)
            self._waiting.append(cell)
        self.failed = {}
        self.reason = None
        if self._open and self.state == "failed":
            self.state = "queued"

    def status(self) -> BakeStatus:
        """Where the bake stands."""
        return BakeStatus(
            state=self.state,
            total=self.total,
            done=self.total - len(self._open) - len(self.failed),
            failed=len(self.failed),
            running=len(self.running),
            reasons=dict(self.failed),
            reason=self.reason,
        )

    def _settle(self) -> None:
        if not self._open and self.state != "cancelled":
            self.state = "failed" if self.failed else "done"
