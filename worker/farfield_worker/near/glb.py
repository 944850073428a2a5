"""A small writer of binary glTF 2.0 (specification, section 4.4); equal content, equal bytes.

Triangles can be packed (EXT_meshopt_compression, mode TRIANGLES): what they unpack to is described
as a second buffer that the file does not have.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import meshoptimizer
import numpy as np
from numpy.typing import NDArray

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
PACKED = "EXT_meshopt_compression"
_COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class GlbWriter:
    """Collects buffer views and accessors, then writes one GLB with them and `extra` JSON."""

    def __init__(self) -> None:
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._body = bytearray()
        self._unpacked = 0

    def add(
        self,
        array: NDArray[Any],
        target: int | None,
        *,
        normalized: bool = False,
        bounds: bool = False,
    ) -> int:
        """Append (n, k) data as a buffer view with one accessor; returns the accessor.

        Without a `target` it is data of our own. Rows of vertex data are padded to a multiple of
        four bytes, as the specification demands.
        """
        rows = np.ascontiguousarray(array).reshape(len(array), -1)
        row = rows.dtype.itemsize * rows.shape[1]
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._body)}
        if target == ARRAY_BUFFER:
            stride = -(-row // 4) * 4
            padded = np.zeros((len(rows), stride), np.uint8)
            padded[:, :row] = rows.view(np.uint8)
            data = padded.tobytes()
            view["byteStride"] = stride
        else:
            data = rows.tobytes()
        view["byteLength"] = len(data)
        if target is not None:
            view["target"] = target
        self._body += data + bytes(-len(data) % 4)
        accessor: dict[str, Any] = {
            "bufferView": len(self._views),
            "componentType": _COMPONENTS[rows.dtype.str[1:]],
            "count": len(rows),
            "type": _SHAPES[rows.shape[1]],
        }
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor["min"] = rows.min(axis=0).tolist()
            accessor["max"] = rows.max(axis=0).tolist()
        self._views.append(view)
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add_blob(self, data: bytes) -> int:
        """Append a file, an image for one; returns its buffer view."""
        view = {"buffer": 0, "byteOffset": len(self._body), "byteLength": len(data)}
        self._views.append(view)
        self._body += data + bytes(-len(data) % 4)
        return len(self._views) - 1

    def add_range(self, array: NDArray[Any], cuts: list[tuple[int, int]]) -> list[int]:
        """Append data of our own; returns an accessor for each (first, count) in `cuts`."""
        self.add(array.reshape(-1, 1), None)
        self._accessors.pop()
        return self._cut(array.dtype, cuts)

    def add_triangles(self, array: NDArray[Any], cuts: list[tuple[int, int]]) -> list[int]:
        """Append (n, 3) indices, packed; returns an accessor for each (first, count) in `cuts`.

        Triangles keep their order and their direction; which corner comes first may change.
        """
        packed = meshoptimizer.encode_index_buffer(array.astype(np.uint32).reshape(-1))
        view = {
            "buffer": 1,
            "byteOffset": self._unpacked,
            "byteLength": array.nbytes,
            "target": ELEMENT_ARRAY_BUFFER,
            "extensions": {
                PACKED: {
                    "buffer": 0,
                    "byteOffset": len(self._body),
                    "byteLength": len(packed),
                    "byteStride": array.itemsize,
                    "count": array.size,
                    "mode": "TRIANGLES",
                }
            },
        }
        self._views.append(view)
        self._body += packed + bytes(-len(packed) % 4)
        self._unpacked += array.nbytes + -array.nbytes % 4
        return self._cut(array.dtype, [(3 * first, 3 * count) for first, count in cuts])

    def _cut(self, dtype: np.dtype[Any], cuts: list[tuple[int, int]]) -> list[int]:
        """Scalar accessors for (first, count) of the last view's numbers."""
        view, start = len(self._views) - 1, len(self._accessors)
        for first, count in cuts:
            self._accessors.append(
                {
                    "bufferView": view,
                    "byteOffset": first * dtype.itemsize,
                    "componentType": _COMPONENTS[dtype.str[1:]],
                    "count": count,
                    "type": "SCALAR",
                }
            )
        return list(range(start, start + len(cuts)))

    def finish(self, extra: dict[str, Any]) -> bytes:
        """Return the file; `extra` holds every member of the root but buffers and accessors."""
        buffers: list[dict[str, Any]] = [{"byteLength": len(self._body)}]
        if self._unpacked:
            buffers.append(
                {"byteLength": self._unpacked, "extensions": {PACKED: {"fallback": True}}}
            )
        root = {
            "asset": {"version": "2.0", "generator": "farfield"},
            "buffers": buffers,
            "bufferViews": self._views,
            "accessors": self._accessors,
        } | extra
        text = json.dumps(root, separators=(",", ":"), sort_keys=True).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self._body)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, total),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(self._body), b"BIN\0"),
                bytes(self._body),
            ]
        )
