"""All surfaces behind the texels of one face, not only the nearest."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Fragments(NamedTuple):
    """Fragments of one face of one eye, sorted by texel, nearest first.

    Attributes:
        texel: (n,) int32, row * resolution + column.
        disparity: (n,) float32, 1/m.
        color: (n,) uint32, sRGB, RGBA8 packed with red lowest; alpha is 255.
        triangle: (n,) int32, index of the scene's triangle.
    """

    texel: NDArray[np.int32]
    disparity: NDArray[np.float32]
    color: NDArray[np.uint32]
    triangle: NDArray[np.int32]

    def take(self, which: NDArray[Any]) -> Fragments:
        """Fragments at indices or a mask `which`, in order."""
        return Fragments(*(column[which] for column in self))


def sort_fragments(
    records: NDArray[np.uint32], triangles: NDArray[np.int32], resolution: int
) -> Fragments:
    """Sort `records` (n, 4) uint32: texel, bits of the disparity, colour, row of `triangles`.

    The order is by texel, then from near to far, then by row, however the records came.
    """
    order = np.empty(len(records), np.int32)
    _sort(records, np.zeros(resolution * resolution + 1, np.int32), order)
    columns = np.ascontiguousarray(records[order].T)
    return Fragments(
        columns[0].view(np.int32),
        columns[1].view(np.float32),
        columns[2],
        triangles[columns[3]],
    )


@njit(cache=True)
def _sort(records: Any, starts: Any, order: Any) -> None:
    """Counting sort by texel, then insertion sort of each texel's few fragments."""
    for i in range(len(records)):
        starts[records[i, 0] + 1] += 1
    for t in range(1, len(starts)):
        starts[t] += starts[t - 1]
    for i in range(len(records)):
        t = records[i, 0]
        order[starts[t]] = i
        starts[t] += 1
    begin = 0
    for t in range(len(starts) - 1):
        end = starts[t]
        for i in range(begin + 1, end):
            moved = order[i]
            j = i
            # positive floats are ordered like their bits
            while j > begin and (
                records[order[j - 1], 1] < records[moved, 1]
                or (
                    records[order[j - 1], 1] == records[moved, 1]
                    and records[order[j - 1], 3] > records[moved, 3]
                )
            ):
                order[j] = order[j - 1]
                j -= 1
            order[j] = moved
        begin = end
