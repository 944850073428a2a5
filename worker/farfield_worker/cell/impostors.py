"""What the two kinds of bake hand on to the cell file: pages, quads and their eyes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple, Protocol

import numpy as np
from farfield_core.scene import Triple
from farfield_core.walk import Quads
from numpy.typing import NDArray

from farfield_worker.visibility.sampling import Watcher


class Impostors(NamedTuple):
    """A cell's quads and pages.

    Attributes:
        eyes: eyes that quads refer to, scene coordinates; the first is the cell's centre.
        quads: front to back.
        pages: (p, height, width, 4) uint8, sRGB, alpha 0 or 255.
        figures: numbers about how they were made.
    """

    eyes: tuple[Triple, ...]
    quads: Quads
    pages: NDArray[np.uint8]
    figures: dict[str, float]


class Stopwatch:
    """Seconds spent on each kind of work."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, kind: str) -> Iterator[None]:
        """Count the time of the block under `kind`."""
        start = time.perf_counter()
        yield
        self._seconds[kind] = self._seconds.get(kind, 0.0) + time.perf_counter() - start

    def figures(self) -> dict[str, float]:
        """Seconds of each kind as `seconds_<kind>`, and their sum as `seconds`."""
        out = {f"seconds_{kind}": spent for kind, spent in self._seconds.items()}
        return out | {"seconds": sum(self._seconds.values())}


#: shows what the cell's eyes see to the watchers given, and to those of the near polygons
Look = Callable[[Sequence[Watcher]], None]


class ImpostorMaker(Protocol):
    """Makes the impostors of one cell after the other."""

    #: GL vendor and renderer string, for logs
    name: str

    def make(
        self, centre: NDArray[np.float64], watch: Stopwatch, look: Look | None = None
    ) -> Impostors:
        """Impostors of the cell around `centre` (3,), scene coordinates.

        `look` is to be called once; it is None where visibility is off.
        """
        ...

    def close(self) -> None:
        """Free what the GPU holds."""
        ...


def triple(point: NDArray[np.float64]) -> Triple:
    """Return (3,) float as plain numbers."""
    x, y, z = (float(c) for c in point)
    return x, y, z
