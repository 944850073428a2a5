"""Baking cells in a child of a pool process, as a server that bakes by itself does.

The pool process stays free of GL, and learns how a child died instead of dying with it.
"""

from __future__ import annotations

from collections.abc import Sequence

from farfield_core.dispatch.executor import COMMAND, Executor, ExecutorError
from farfield_core.dispatch.queues import LONGEST

#: seconds in which a child has to become ready
START_TIMEOUT = 300.0


class Baker:
    """Bakes one cell at a time; its child holds on to one bake until another is asked for."""

    def __init__(self, store: str, command: Sequence[str] = COMMAND) -> None:
        self._store = store
        self._command = command
        self._executor: Executor | None = None

    def bake_cell(self, bake: str, cell: str) -> None:
        """Bake a cell; raises CellError and ExecutorError, after which the child is a new one."""
        executor = self._executor
        if executor is None or executor.bake != bake:
            self.close()
            executor = self._executor = Executor(self._store, bake, self._command)
        try:
            executor.wait_ready(START_TIMEOUT)
            executor.bake_cell(cell, LONGEST - START_TIMEOUT)
        except ExecutorError:
            self.close()
            raise

    def close(self) -> None:
        """End the child."""
        if self._executor is not None:
            self._executor.close()
            self._executor = None
