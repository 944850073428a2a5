"""glTF mesh primitives (specification, section 3.7.2) as meshes with the vertices they use."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.gltf.accessors import Accessors, to_float
from farfield_worker.prepare.gltf.document import Json
from farfield_worker.prepare.gltf.draco import DracoPrimitive
from farfield_worker.prepare.model import Material, Mesh

_STRIP, _FAN, _TRIANGLES = 5, 6, 4


class Primitives:
    """Reads the primitives of one document."""

    def __init__(self, accessors: Accessors, materials: list[Material]) -> None:
        self.accessors = accessors
        self.document = accessors.document
        self.materials = materials

    def read(self, primitive: Json) -> Mesh | None:
        """One primitive; None for lines, points and empty ones."""
        mode = primitive.get("mode", _TRIANGLES)
        if mode in (0, 1, 2, 3):
            self.document.note("Lines and points were left out.")
            return None
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            self.document.refuse(f"a primitive has the unknown mode {mode!r}")
        if "POSITION" not in primitive.get("attributes", {}):
            self.document.note("A primitive without positions was left out.")
            return None
        source = _Source(self.accessors, primitive)
        corners = source.corners
        if mode == _TRIANGLES:
            triangles = corners[: len(corners) // 3 * 3].reshape(-1, 3)
        else:
            triangles = _unroll(corners, mode)
        if len(triangles) == 0:
            return None
        if int(triangles.max()) >= source.count:
            self.document.refuse("a primitive's indices point beyond its vertices")
        rows, compact = used_vertices(triangles, source.count)
        number = primitive.get("material", len(self.materials) - 1)
        if not isinstance(number, int) or not 0 <= number < len(self.materials):
            self.document.refuse(f"it refers to material {number!r}, which it does not have")
        return Mesh(
            source.floats("POSITION", rows, 3),
            compact,
            number,
            source.floats("NORMAL", rows, 3) if source.has("NORMAL") else None,
            self._uvs(source, rows, self.materials[number]),
            source.colors(rows),
        )

    def _uvs(
        self, source: _Source, rows: NDArray[Any] | slice, material: Material
    ) -> NDArray[np.float32] | None:
        use = material.base or material.emissive_texture
        if use is None:
            return None
        name = f"TEXCOORD_{use.texcoord}"
        if not source.has(name):
            return None
        uvs = source.floats(name, rows, 2)
        if use.transform is not None:
            matrix = np.array(use.transform)
            uvs = (uvs @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32)
        return uvs


class _Source:
    """Attributes of a primitive, plain or decoded by Draco."""

    def __init__(self, accessors: Accessors, primitive: Json) -> None:
        self.accessors = accessors
        self.attributes = primitive["attributes"]
        packed = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
        self.draco = None if packed is None else DracoPrimitive(accessors, primitive, packed)
        self.count = len(self.raw("POSITION"))
        if self.draco is not None:
            self.corners: NDArray[Any] = self.draco.triangles.reshape(-1)
        elif "indices" in primitive:
            self.corners = accessors.raw(primitive["indices"])[:, 0]
            if self.corners.dtype.kind != "u":
                accessors.document.refuse("a primitive's indices are of a wrong type")
        else:
            accessors.document.charge(self.count * 4)
            self.corners = np.arange(self.count, dtype=np.uint32)

    def has(self, name: str) -> bool:
        return name in self.attributes

    def raw(self, name: str) -> NDArray[Any]:
        data = None if self.draco is None else self.draco.column(name)
        return self.accessors.raw(self.attributes[name]) if data is None else data

    def floats(self, name: str, rows: NDArray[Any] | slice, width: int) -> NDArray[np.float32]:
        raw = self.raw(name)
        document = self.accessors.document
        if raw.shape[1] != width or len(raw) < self.count:
            document.refuse(f"a primitive's {name} does not fit its positions")
        entry = document.item("accessors", self.attributes[name])
        return to_float(raw[rows], bool(entry.get("normalized", False)))

    def colors(self, rows: NDArray[Any] | slice) -> NDArray[np.uint16] | None:
        """COLOR_0, linear times 65535; floats out of [0, 1] are clamped."""
        if not self.has("COLOR_0"):
            return None
        raw = self.raw("COLOR_0")
        if raw.shape[1] not in (3, 4) or len(raw) < self.count:
            self.accessors.document.refuse("a primitive's COLOR_0 does not fit its positions")
        value = to_float(raw[rows], True)
        out = np.full((len(value), 4), 65535, np.uint16)
        out[:, : raw.shape[1]] = np.rint(np.clip(np.nan_to_num(value, nan=1), 0, 1) * 65535)
        return out


def used_vertices(
    triangles: NDArray[Any], count: int
) -> tuple[NDArray[Any] | slice, NDArray[np.uint32]]:
    """Rows of the vertices that (m, 3) `triangles` use, of `count`, and triangles of those rows."""
    if count > 8 * triangles.size:
        # a small piece of a large shared buffer: the work must follow the piece
        rows, compact = np.unique(triangles, return_inverse=True)
        return rows, compact.reshape(-1, 3).astype(np.uint32)
    used = np.zeros(count, np.bool_)
    used[triangles.reshape(-1)] = True
    if used.all():
        return slice(None), np.ascontiguousarray(triangles, np.uint32)
    place = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
    return np.flatnonzero(used), place[triangles]


def _unroll(corners: NDArray[Any], mode: int) -> NDArray[Any]:
    """Triangles of a strip or fan, all counter-clockwise."""
    count = max(len(corners) - 2, 0)
    k = np.arange(count)
    if mode == _FAN:
        return np.stack(
            [corners[1 : count + 1], corners[2:], np.repeat(corners[:1], count)], axis=1
        )
    odd = k & 1
    return np.stack([corners[k], corners[k + 1 + odd], corners[k + 2 - odd]], axis=1)
