"""Who bakes the cells of a bake: the promise of a dispatcher, and what it tells of its work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, runtime_checkable

from farfield_core.dispatch.slots import Slot

State = Literal["queued", "running", "paused", "cancelled", "done", "failed"]

#: a bake in one of these states has nothing left to do
ENDED: tuple[State, ...] = ("cancelled", "done", "failed")


@dataclass(frozen=True)
class Event:
    """Something that happened to a bake.

    Attributes:
        bake: which bake.
        kind: "state" (see `state`), "started", "done", "retried" or "failed" (see `cell`).
        state: the bake's state after the event.
        cell: name of the cell, None for "state".
        figures: numbers about a cell that is done, as in its file.
        reason: one sentence on what went wrong.
    """

    bake: str
    kind: Literal["state", "started", "done", "retried", "failed"]
    state: State
    cell: str | None = None
    figures: Mapping[str, float] = field(default_factory=dict)
    reason: str | None = None


@dataclass(frozen=True)
class BakeStatus:
    """Where a bake stands.

    Attributes:
        state: done when every cell exists; failed when nothing is left to try and a cell failed.
        total, done, failed, running: numbers of cells.
        reasons: a sentence for each failed cell, by the cell's name.
        reason: why the bake as a whole cannot go on, one sentence.
    """

    state: State
    total: int
    done: int
    failed: int
    running: int
    reasons: Mapping[str, str] = field(default_factory=dict)
    reason: str | None = None


Listener = Callable[[Event], None]


class Dispatcher(Protocol):
    """Bakes what is missing of the bakes it is given. Safe to call from any thread."""

    def submit(self, bake: str) -> None:
        """Bake every missing cell of a bake; nothing happens if that is under way."""
        ...

    def first(self, bake: str, cells: Iterable[str]) -> None:
        """Bake these cells before all others; the first named comes first."""
        ...

    def pause(self, bake: str) -> None:
        """Begin no more cells; those under way are finished."""
        ...

    def resume(self, bake: str) -> None:
        """Go on with a paused bake."""
        ...

    def cancel(self, bake: str) -> None:
        """Stop at once; what is done stays, and `submit` takes the bake up again."""
        ...

    def retry(self, bake: str) -> None:
        """Try failed cells anew."""
        ...

    def status(self, bake: str) -> BakeStatus:
        """Where a bake stands; raises NotFoundError for one never submitted."""
        ...

    def wait(self, bake: str, timeout: float | None = None) -> BakeStatus:
        """Wait until a bake has ended, or for `timeout` seconds."""
        ...

    def close(self) -> None:
        """Stop all work at once and free everything."""
        ...


@runtime_checkable
class FarmView(Protocol):
    """What a dispatcher that feeds a farm knows of its workers."""

    def slots(self) -> list[Slot]:
        """Processes of living workers."""
        ...

    def aside(self) -> dict[str, str]:
        """Living workers that were set aside, and why."""
        ...

    def left(self) -> int:
        """Cells that are still to be baked of all bakes that may go on."""
        ...

    def wanted(self) -> int:
        """Workers that those cells are worth."""
        ...
