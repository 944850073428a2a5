"""Baking all missing cells of a walk on this machine, with a progress bar."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import click
from farfield_core import layout
from farfield_core.bake import done_cells
from farfield_core.cells import Index
from farfield_core.dispatch import BakeStatus, Event
from farfield_core.dispatch.executor import COMMAND
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.store import Store
from farfield_core.walk import Walk

from farfield.progress import CellProgress

#: figures of cells that are reported as means
MEANS = ("quads", "texels", "near_triangles", "atlas_bytes")


@dataclass(frozen=True)
class Outcome:
    """How a bake ended: the dispatcher's last word, and the figures that `bake --json` prints."""

    status: BakeStatus
    figures: dict[str, Any]

    def complaint(self) -> str:
        """One sentence on why it failed."""
        if self.status.reason:
            return self.status.reason
        cell, reason = next(iter(self.status.reasons.items()))
        return (
            f"{self.status.failed} of {self.status.total} cells could not be baked, "
            f"the first of them {cell}: {reason}"
        )


class Means:
    """Mean figures of cells as they come."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0
        self._sums = dict.fromkeys(("seconds", *MEANS), 0.0)

    def add(self, figures: Mapping[str, float]) -> None:
        """Take in one cell."""
        with self._lock:
            self._count += 1
            for name in self._sums:
                self._sums[name] += figures.get(name, 0.0)

    def result(self) -> dict[str, float]:
        """Means over all cells taken in; zero where there were none."""
        with self._lock:
            means = {name: total / max(self._count, 1) for name, total in self._sums.items()}
        return {"seconds_per_cell": means.pop("seconds"), **means}


def bake_all(
    store: Store, walk: Walk, jobs: int | None, command: Sequence[str] = COMMAND
) -> Outcome:
    """Bake what is missing of a walk.

    `command` starts an executor. When interrupted, says that running again resumes and lets
    KeyboardInterrupt pass; what is baked stays.
    """
    before = done_cells(store, walk.id)
    means = Means()
    with CellProgress(walk.grid.total, len(before)) as progress:

        def listen(event: Event) -> None:
            if event.kind == "done":
                means.add(event.figures)
                progress.one_more()
            elif event.kind in ("retried", "failed"):
                progress.say(f"Cell {event.cell} {event.kind}: {event.reason}")

        dispatcher = LocalDispatcher(store, jobs, listen, command)
        try:
            dispatcher.submit(walk.id)
            status = dispatcher.wait(walk.id)
        except KeyboardInterrupt:
            dispatcher.close()
            there = dispatcher.status(walk.id).done
            click.echo(
                f"{there} of {walk.grid.total} cells are baked; "
                "run the same command again to bake the rest.",
                err=True,
            )
            raise
        finally:
            dispatcher.close()
    for index in before:
        means.add(cell_figures(store, walk.id, index))
    figures = {
        "bake": walk.id,
        "cells": status.done,
        "failed": status.failed,
        "near_field": walk.near_field,
        **means.result(),
    }
    return Outcome(status, figures)


def cell_figures(store: Store, bake: str, index: Index) -> dict[str, float]:
    """Figures of a cell that was baked before."""
    figures = json.loads(store.get(layout.cell_key(bake, index)))["figures"]
    return {str(name): float(value) for name, value in figures.items()}
