"""Baking cells in a child of a pool process, as a server that bakes by itself does.

The pool process stays free of GL, and learns how a child died instead of dying with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from farfield_core.dispatch.executor import COMMAND, Executor, ExecutorError, StoreFaultError
from farfield_core.errors import BadInputError
from farfield_core.memory import machine_bytes

#: seconds in which a child has to become ready
START_TIMEOUT = 300.0
#: a child is replaced when it has this many times the memory that it had after its first cell,
#: and this many bytes more
_GROWTH, _GROWTH_BYTES = 2.0, 512 << 20


class StartError(Exception):
    """A child did not come up: the machine is to blame, not the cell."""


@dataclass(frozen=True)
class Limits:
    """What a cell may take.

    Attributes:
        seconds: after which it counts as hung.
        bytes: of memory that its process may have to itself.
    """

    seconds: float = 600.0
    bytes: int | None = None

    @classmethod
    def from_environment(cls, environ: Mapping[str, str], jobs: int) -> Limits:
        """FARFIELD_CELL_SECONDS and FARFIELD_CELL_MEGABYTES, by default a fair share of all memory.

        Raises BadInputError.
        """
        share = 0.9 * machine_bytes() / jobs
        seconds = _positive(environ, "FARFIELD_CELL_SECONDS", cls.seconds)
        megabytes = _positive(environ, "FARFIELD_CELL_MEGABYTES", share / 1e6)
        return cls(seconds, int(megabytes * 1e6))


def _positive(environ: Mapping[str, str], name: str, default: float) -> float:
    text = environ.get(name)
    if not text:
        return default
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e12:
        raise BadInputError(f"{name} cannot be {text!r}; give a positive number.")
    return value


class Baker:
    """Bakes one cell at a time; its child holds on to one bake until another is asked for."""

    def __init__(
        self, store: str, command: Sequence[str] = COMMAND, limits: Limits | None = None
    ) -> None:
        self._store = store
        self._command = command
        self._limits = limits or Limits()
        self._executor: Executor | None = None
        self._first_bytes = 0
        self.renderer = ""

    def bake_cell(self, bake: str, cell: str) -> dict[str, float]:
        """Bake a cell and return its figures.

        Raises CellError, ExecutorError, StartError and StoreFaultError; after all but the first the
        child is a new one.
        """
        executor = self._executor
        if executor is None or executor.bake != bake:
            self.close()
            executor = self._executor = self._start(bake)
            self._first_bytes = 0
        try:
            try:
                executor.wait_ready(START_TIMEOUT)
            except ExecutorError as error:
                raise StartError(str(error)) from None
            self.renderer = executor.renderer
            figures = executor.bake_cell(cell, self._limits.seconds)
        except (ExecutorError, StartError, StoreFaultError):
            self.close()
            raise
        self._recycle(executor)
        return figures

    def drop(self) -> None:
        """End the child at once, from any thread; who waits for it gets an ExecutorError."""
        executor = self._executor
        if executor is not None:
            executor.kill()

    @property
    def megabytes(self) -> float:
        """Memory of the child."""
        executor = self._executor
        return executor.memory / 1e6 if executor is not None else 0.0

    def close(self) -> None:
        """End the child."""
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.close()

    def _start(self, bake: str) -> Executor:
        try:
            return Executor(self._store, bake, self._command, memory=self._limits.bytes)
        except OSError as error:
            raise StartError(f"The process could not be started: {error}.") from None

    def _recycle(self, executor: Executor) -> None:
        """Replace a child whose memory grows from cell to cell."""
        now = executor.memory
        self._first_bytes = self._first_bytes or now
        if now > max(_GROWTH * self._first_bytes, self._first_bytes + _GROWTH_BYTES):
            self.close()
