"""The lattice of view cells: which exist, where they are, what they are called."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farfield_core.errors import BadInputError, NotFoundError

Index = tuple[int, int, int]


def cell_name(index: Index) -> str:
    """Name of a cell in files and addresses: `i_j_k`."""
    return "_".join(str(n) for n in index)


def parse_cell_name(name: str) -> Index:
    """Inverse of `cell_name`; raises BadInputError for anything else."""
    match = re.fullmatch(r"(-?\d{1,9})_(-?\d{1,9})_(-?\d{1,9})", name)
    if match is None:
        raise BadInputError(f"{name!r} is not a cell; cells are named i_j_k, as in 0_0_3.")
    return int(match[1]), int(match[2]), int(match[3])


@dataclass(frozen=True)
class CellGrid:
    """The view cells of a corridor.

    Cell (i, j, k) is the box of extent `size` from (origin.x + i size.x, y, origin.z + k size.z).
    Without ground following y is origin.y + j size.y; with it each column has its own.

    Attributes:
        origin: (3,) float, the lattice's min corner, metres, scene coordinates.
        size: (3,) float, edge lengths of every cell, metres.
        index: (n, 3) int32, lattice indices, in the order in which cells are baked.
        y: (n,) float, lowest y of each cell.
    """

    origin: NDArray[np.float64]
    size: NDArray[np.float64]
    index: NDArray[np.int32]
    y: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.index)

    def indices(self) -> list[Index]:
        """All cell indices in baking order."""
        return [(int(i), int(j), int(k)) for i, j, k in self.index]

    def corners(self) -> NDArray[np.float64]:
        """Min corners of all cells, (n, 3) float."""
        low = self.origin + self.index * self.size
        low[:, 1] = self.y
        return low

    def centres(self) -> NDArray[np.float64]:
        """Reference viewpoints of all cells, (n, 3) float."""
        return self.corners() + self.size / 2

    def centre(self, index: Index) -> NDArray[np.float64]:
        """Reference viewpoint of one cell, (3,) float; raises NotFoundError."""
        rows = np.flatnonzero((self.index == np.asarray(index, np.int32)).all(axis=1))
        if len(rows) == 0:
            raise NotFoundError(f"The corridor has no cell {cell_name(index)}.")
        row = int(rows[0])
        low = self.origin + self.index[row] * self.size
        low[1] = self.y[row]
        return np.asarray(low + self.size / 2, np.float64)
