"""glTF accessors (specification, section 3.6.2) as NumPy arrays, checked against their buffers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.gltf.document import Bytes, Document, Json, size_of
from farfield_worker.prepare.gltf.meshopt import decode_view

_COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Accessors:
    """Reads accessors of one document; compressed buffer views are decoded once."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._decoded: dict[int, Bytes] = {}

    def view(self, index: Any) -> tuple[Bytes, int]:
        """Bytes and stride (0: tightly packed) of a buffer view."""
        entry = self.document.item("bufferViews", index)
        packed = entry.get("extensions", {}).get("EXT_meshopt_compression")
        if packed is not None:
            if index not in self._decoded:
                self._decoded[index] = decode_view(self.document, packed)
            return self._decoded[index], size_of(self.document, packed, "byteStride")
        return self.document.slice(entry), size_of(self.document, entry, "byteStride", 0)

    def raw(self, index: Any) -> NDArray[Any]:
        """(count, components) array of an accessor in its own type; a view where possible."""
        document = self.document
        entry = document.item("accessors", index)
        dtype, width = self.layout(entry)
        count = size_of(document, entry, "count")
        if "bufferView" in entry:
            array = self._strided(entry, entry["bufferView"], count, dtype, width)
        elif "sparse" in entry:
            document.charge(count * dtype.itemsize * width)
            array = np.zeros((count, width), dtype)
        else:
            document.refuse(f"accessor {index} has no data")
        if "sparse" in entry:
            array = self._sparse(entry["sparse"], array, dtype, width)
        return array

    def layout(self, entry: Json) -> tuple[np.dtype[Any], int]:
        """Component type and number of components of an accessor."""
        dtype = _COMPONENTS.get(entry.get("componentType", 0))
        width = _WIDTHS.get(entry.get("type", ""))
        if dtype is None or width is None:
            self.document.refuse("an accessor has an unknown type")
        return dtype, width

    def floats(self, index: Any) -> NDArray[np.float32]:
        """(count, components) float32, normalised integers scaled."""
        normalized = bool(self.document.item("accessors", index).get("normalized", False))
        return to_float(self.raw(index), normalized)

    def _strided(
        self, entry: Json, view: Any, count: int, dtype: np.dtype[Any], width: int
    ) -> NDArray[Any]:
        data, stride = self.view(view)
        start = size_of(self.document, entry, "byteOffset", 0)
        element = dtype.itemsize * width
        stride = stride or element
        if count and start + stride * (count - 1) + element > len(data):
            self.document.refuse("an accessor reaches beyond its buffer view")
        if count == 0:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))

    def _sparse(
        self, sparse: Json, base: NDArray[Any], dtype: np.dtype[Any], width: int
    ) -> NDArray[Any]:
        count = size_of(self.document, sparse, "count")
        where = sparse["indices"]
        kind, _ = self.layout({"type": "SCALAR", **where})
        if kind.kind != "u":
            self.document.refuse("a sparse accessor has indices of a wrong type")
        rows = self._strided(where, where.get("bufferView"), count, kind, 1)[:, 0]
        values = sparse["values"]
        fresh = self._strided(values, values.get("bufferView"), count, dtype, width)
        if count and int(rows.max()) >= len(base):
            self.document.refuse("a sparse accessor changes elements that it does not have")
        self.document.charge(base.nbytes)
        array = np.array(base)
        array[rows] = fresh
        return array


def to_float(array: NDArray[Any], normalized: bool) -> NDArray[np.float32]:
    """Floats of an accessor's elements (specification, section 3.6.2.2; KHR_mesh_quantization)."""
    out = np.ascontiguousarray(array, np.float32)
    if normalized and array.dtype.kind in "iu":
        out = out / np.float32(np.iinfo(array.dtype).max)
        if array.dtype.kind == "i":
            np.maximum(out, -1, out=out)
    return out
