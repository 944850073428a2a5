"""NumPy files of a length that is known only once they are written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


class GrowingArray:
    """Writes a .npy file piece by piece; `close` puts the final shape into the header."""

    def __init__(self, path: Path, dtype: DTypeLike, width: int) -> None:
        self.dtype, self.width, self.rows = np.dtype(dtype), width, 0
        self._file = path.open("wb")
        self._body = self._header()

    def append(self, rows: NDArray[Any]) -> None:
        """Add (n, width) rows of the array's type."""
        assert rows.dtype == self.dtype
        assert rows.shape[1] == self.width
        np.ascontiguousarray(rows).tofile(self._file)
        self.rows += len(rows)

    def close(self) -> None:
        """Finish the file."""
        self._file.seek(0)
        # NumPy pads headers so that they keep their length while the first dimension grows
        assert self._header() == self._body
        self._file.close()

    def _header(self) -> int:
        np.lib.format.write_array_header_1_0(
            self._file,
            {
                "descr": np.lib.format.dtype_to_descr(self.dtype),
                "fortran_order": False,
                "shape": (self.rows, self.width),
            },
        )
        return self._file.tell()
