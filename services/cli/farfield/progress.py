"""Progress on standard error: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    DownloadColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
    TransferSpeedColumn,
)
from rich.text import Text

#: seconds between lines where there is no terminal
LINE_EVERY = 5.0


def console() -> Console:
    """Where progress goes."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say what is being done for as long as it takes."""
    screen = console()
    if screen.is_terminal:
        with screen.status(what + " …"):
            yield
    else:
        screen.print(what + " …")
        yield


@contextmanager
def bytes_progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar of bytes sent; gives the function to call with bytes sent and bytes in all."""
    screen = console()
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
        TimeRemainingColumn(),
        console=screen,
        disable=not screen.is_terminal,
    )
    said = time.monotonic()

    def tell(sent: int, total: int) -> None:
        nonlocal said
        bar.update(task, completed=sent, total=total)
        now = time.monotonic()
        if not screen.is_terminal and (sent == total or now - said > LINE_EVERY):
            said = now
            screen.print(f"{sent / 1e6:.1f} of {total / 1e6:.1f} MB")

    with bar:
        task = bar.add_task(what, total=None)
        yield tell


class _CellsPerSecond(ProgressColumn):
    def render(self, task: Task) -> Text:
        """How fast cells come."""
        return Text(f"{task.speed:.2f} cells/s" if task.speed else "- cells/s")


class CellProgress:
    """Cells done, cells per second and the time left."""

    def __init__(self, total: int, done: int, what: str = "baking") -> None:
        self._console = console()
        self._total = total
        self._first = self._done = done
        self._began = self._said = time.monotonic()
        self._bar = Progress(
            TextColumn(what),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("cells"),
            _CellsPerSecond(),
            TimeRemainingColumn(),
            TextColumn("left"),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task(what, total=total, completed=done)

    def __enter__(self) -> CellProgress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def one_more(self) -> None:
        """A cell is done."""
        self.update(self._done + 1)

    def update(self, done: int, total: int | None = None) -> None:
        """So many cells are done, of so many."""
        if done <= self._done:
            return
        self._done = done
        self._total = total or self._total
        self._bar.update(self._task, completed=done, total=self._total)
        now = time.monotonic()
        last = self._done == self._total
        if not self._console.is_terminal and (last or now - self._said > LINE_EVERY):
            self._said = now
            rate = (self._done - self._first) / max(now - self._began, 1e-9)
            left = (self._total - self._done) / rate
            self._console.print(
                f"{self._done}/{self._total} cells, {rate:.2f} cells/s, {left:.0f} s left"
            )

    def say(self, text: str) -> None:
        """A line above the bar."""
        self._bar.console.print(text)
