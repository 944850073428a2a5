"""Whose fault it is: a cell that fails on every worker, or a worker that fails every cell.

A cell is given up after three attempts on three workers, or on as many as there are. A worker is to
be set aside when three cells that it failed were then baked by others.
"""

from __future__ import annotations

from collections.abc import Collection

from farfield_core.control import Attempt
from farfield_core.dispatch.jobs import ATTEMPTS

#: cells that a worker may fail and others bake
INNOCENT = 3


class Blame:
    """The attempts at cells that went wrong. Not thread-safe: its owner holds a lock."""

    def __init__(self) -> None:
        self._attempts: dict[tuple[str, str], dict[str, Attempt]] = {}
        self._innocent: dict[str, set[tuple[str, str]]] = {}

    def add(self, bake: str, cell: str, name: str, attempt: Attempt) -> bool:
        """Take in an attempt; False if it is known."""
        known = self._attempts.setdefault((bake, cell), {})
        if name in known:
            return False
        known[name] = attempt
        return True

    def names(self, bake: str) -> set[str]:
        """Names of a bake's attempts."""
        return {n for (b, _), known in self._attempts.items() if b == bake for n in known}

    def workers(self, bake: str, cell: str) -> set[str]:
        """Workers that failed a cell."""
        return {a.worker for a in self._attempts.get((bake, cell), {}).values()}

    def verdict(self, bake: str, cell: str, live: Collection[str]) -> str | None:
        """Why a cell is to be given up, None if it is to be tried again by one of `live`."""
        attempts = self._attempts.get((bake, cell), {})
        tried = self.workers(bake, cell)
        others = set(live) - tried
        if len(attempts) < ATTEMPTS or (len(tried) < ATTEMPTS and others):
            return None
        reason = list(attempts.values())[-1].reason
        places = f" by {len(tried)} workers" if len(tried) > 1 else ""
        return f"{reason} (tried {len(attempts)} times{places})"

    def baked(self, bake: str, cell: str, worker: str) -> set[str]:
        """A worker baked a cell; returns who has failed too many cells that others could bake."""
        faulty = set()
        for other in self.workers(bake, cell) - {worker}:
            innocent = self._innocent.setdefault(other, set())
            innocent.add((bake, cell))
            if len(innocent) >= INNOCENT:
                faulty.add(other)
        return faulty

    def forget(self, bake: str) -> None:
        """Let all cells of a bake be tried anew."""
        for key in [key for key in self._attempts if key[0] == bake]:
            del self._attempts[key]
