"""How many workers the work that is left is worth: what an autoscaler is told.

A queue's length says nothing of cells under way, and stays at its bound however much waits behind.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from farfield_core.dispatch.slots import Slot

#: seconds in which the work that is left is to be done
TARGET = 600.0
#: seconds a cell is taken to need until one is known to have been baked
_GUESS = 10.0


def wanted_workers(left: int, slots: Sequence[Slot]) -> int:
    """Workers that bake `left` cells within `TARGET`, as fast as the living `slots` do."""
    if left == 0:
        return 0
    rates = [slot.rate for slot in slots if slot.rate > 0]
    seconds = len(rates) / sum(rates) if rates else _GUESS
    processes = min(left, math.ceil(left * seconds / TARGET))
    workers = len({slot.worker for slot in slots})
    a_worker = len(slots) / workers if workers else 1.0
    return max(1, math.ceil(processes / a_worker))
