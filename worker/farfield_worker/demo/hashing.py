"""Counter-based random numbers: the same everywhere, whatever the machine or library version.

The mixing step is that of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number
generators", 2014): integer arithmetic only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

T = TypeVar("T")

_GOLDEN = 0x9E3779B97F4A7C15
_MASK = (1 << 64) - 1


def _mix(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def uniform(seed: int, *keys: ArrayLike) -> NDArray[np.float64]:
    """Numbers in [0, 1), one for each combination of integer `keys` (broadcast), for one seed."""
    state = np.asarray(seed & _MASK, np.uint64).reshape(1)
    for key in keys:
        k = np.atleast_1d(np.asarray(key)).astype(np.int64).astype(np.uint64)
        state = _mix(state + (k + np.uint64(1)) * np.uint64(_GOLDEN))
    state = _mix(state)
    shape = np.broadcast_shapes(*(np.shape(k) for k in keys))
    return (state >> np.uint64(11)).astype(np.float64).reshape(shape) * 2.0**-53


class Dice:
    """A stream of random numbers for plain loops."""

    def __init__(self, seed: int, *keys: int) -> None:
        self._state = seed & _MASK
        for key in keys:
            self._state = self._next() ^ ((key * _GOLDEN) & _MASK)

    def _next(self) -> int:
        self._state = (self._state + _GOLDEN) & _MASK
        x = self._state
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & _MASK
        return x ^ (x >> 31)

    def between(self, low: float, high: float) -> float:
        """A number in [low, high)."""
        return low + (high - low) * ((self._next() >> 11) * 2.0**-53)

    def chance(self, probability: float) -> bool:
        """True with the given probability."""
        return self.between(0.0, 1.0) < probability

    def whole(self, low: int, high: int) -> int:
        """An integer in [low, high]."""
        return low + int(self.between(0.0, high - low + 1.0))

    def pick(self, items: Sequence[T]) -> T:
        """One of `items`."""
        return items[self.whole(0, len(items) - 1)]
