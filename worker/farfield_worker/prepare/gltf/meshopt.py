"""EXT_meshopt_compression: compressed buffer views, decoded by meshoptimizer."""

from __future__ import annotations

from typing import Any

import meshoptimizer
import numpy as np

from farfield_worker.prepare.gltf.document import Bytes, Document, Json, size_of

#: The densest stream: blocks of at most 256 elements whose bytes never change cost one control byte
#: for every four bytes of an element.
_MOST_PER_BYTE = 1024

_FILTERS = {
    "OCTAHEDRAL": meshoptimizer.decode_filter_oct,
    "QUATERNION": meshoptimizer.decode_filter_quat,
    "EXPONENTIAL": meshoptimizer.decode_filter_exp,
}


def decode_view(document: Document, packed: Json) -> Bytes:
    """Bytes of the buffer view whose extension object is `packed`; refuses damaged ones."""
    data = document.slice(packed)
    count, stride = size_of(document, packed, "count"), size_of(document, packed, "byteStride")
    if count * stride > (len(data) + 64) * _MOST_PER_BYTE:
        document.refuse("a compressed buffer view claims more than it can hold")
    document.charge(count * stride)
    if count == 0:
        return np.zeros(0, np.uint8)
    try:
        out = _decode(packed.get("mode"), count, stride, data)
    except (RuntimeError, ValueError):
        document.refuse("a buffer view compressed with EXT_meshopt_compression is damaged")
    name = packed.get("filter", "NONE")
    if name == "NONE":
        return out
    if name not in _FILTERS or not _fits(name, stride):
        document.refuse(f"it uses the compression filter {name!r}, which is not known")
    return np.asarray(_FILTERS[name](out, count, stride), np.uint8)


def _fits(name: str, stride: int) -> bool:
    # the decoders assert these in C
    if name == "OCTAHEDRAL":
        return stride in (4, 8)
    return stride == 8 if name == "QUATERNION" else stride % 4 == 0


def _decode(mode: Any, count: int, stride: int, data: Bytes) -> Bytes:
    if mode == "ATTRIBUTES":
        element = np.dtype((np.void, stride))
        out = meshoptimizer.decode_vertex_buffer(count, stride, data, element)
        return np.frombuffer(out.tobytes(), np.uint8)
    if mode not in ("TRIANGLES", "INDICES") or stride not in (2, 4):
        raise ValueError(mode)
    if mode == "TRIANGLES" and count % 3:
        raise ValueError(count)
    decode = (
        meshoptimizer.decode_index_buffer
        if mode == "TRIANGLES"
        else meshoptimizer.decode_index_sequence
    )
    indices = decode(count, 4, data)
    return np.asarray(indices, "<u4" if stride == 4 else "<u2").view(np.uint8)
