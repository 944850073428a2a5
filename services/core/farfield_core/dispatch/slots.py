"""A process of a farm worker, as it describes itself."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Slot:
    """A process of a worker, as it describes itself.

    Attributes:
        worker: name of the worker, one for all its processes.
        process: its process id.
        host: the machine.
        device: the queues it serves, "cpu" or "gpu".
        renderer: GL vendor and renderer; empty until the first cell.
        bake, cell: what it bakes; empty when idle.
        done, tried: cells it finished, and attempts that went wrong.
        rate: cells a second over the last minutes.
        megabytes: memory of the baking process.
    """

    worker: str
    process: int
    host: str = ""
    device: str = "cpu"
    renderer: str = ""
    bake: str = ""
    cell: str = ""
    done: int = 0
    tried: int = 0
    rate: float = 0.0
    megabytes: float = 0.0
