"""A small glTF 2.0 binary writer: one node and mesh per district, one primitive per material."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_FLOAT, _BYTE, _UINT = 5126, 5121, 5125


class Primitive(NamedTuple):
    """Triangles of one material: positions, normals (n, 3), uvs (n, 2) float32; colors (n, 4)
    uint8, linear; triangles (m, 3) uint32.
    """

    material: int
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32]
    colors: NDArray[np.uint8]
    triangles: NDArray[np.uint32]


class GlbWriter:
    """Collects the parts of a file; `write` puts them into one GLB."""

    def __init__(self, generator: str) -> None:
        self._blobs: list[bytes] = []
        self._length = 0
        self._doc: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": generator},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "materials": [],
        }

    def _view(self, data: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)}
        if target:
            view["target"] = target
        data += b"\0" * (-len(data) % 4)
        self._blobs.append(data)
        self._length += len(data)
        self._doc["bufferViews"].append(view)
        return len(self._doc["bufferViews"]) - 1

    def _accessor(self, array: NDArray[Any], component: int, kind: str, **more: Any) -> int:
        target = 34963 if kind == "SCALAR" else 34962
        self._doc["accessors"].append(
            {
                "bufferView": self._view(array.tobytes(), target),
                "componentType": component,
                "count": array.size if kind == "SCALAR" else len(array),
                "type": kind,
                **more,
            }
        )
        return len(self._doc["accessors"]) - 1

    def material(
        self, name: str, png: bytes | None, *, mask: bool = False, double_sided: bool = False
    ) -> int:
        """Add a material, its base colour texture given as the bytes of a PNG."""
        pbr: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
        if png is not None:
            images = self._doc.setdefault("images", [])
            images.append({"bufferView": self._view(png), "mimeType": "image/png", "name": name})
            self._doc["samplers"] = [
                {"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}
            ]
            textures = self._doc.setdefault("textures", [])
            textures.append({"sampler": 0, "source": len(images) - 1})
            pbr["baseColorTexture"] = {"index": len(textures) - 1}
        entry: dict[str, Any] = {"name": name, "pbrMetallicRoughness": pbr}
        if mask:
            entry |= {"alphaMode": "MASK", "alphaCutoff": 0.5}
        if double_sided:
            entry["doubleSided"] = True
        self._doc["materials"].append(entry)
        return len(self._doc["materials"]) - 1

    def mesh(self, name: str, primitives: list[Primitive]) -> None:
        """Add a node with a mesh."""
        entries = []
        for p in primitives:
            bounds = {
                "min": [float(x) for x in p.positions.min(axis=0)],
                "max": [float(x) for x in p.positions.max(axis=0)],
            }
            entries.append(
                {
                    "attributes": {
                        "POSITION": self._accessor(p.positions, _FLOAT, "VEC3", **bounds),
                        "NORMAL": self._accessor(p.normals, _FLOAT, "VEC3"),
                        "TEXCOORD_0": self._accessor(p.uvs, _FLOAT, "VEC2"),
                        "COLOR_0": self._accessor(p.colors, _BYTE, "VEC4", normalized=True),
                    },
                    "indices": self._accessor(p.triangles, _UINT, "SCALAR"),
                    "material": p.material,
                }
            )
        self._doc["meshes"].append({"name": name, "primitives": entries})
        self._doc["nodes"].append({"name": name, "mesh": len(self._doc["meshes"]) - 1})
        self._doc["scenes"][0]["nodes"].append(len(self._doc["nodes"]) - 1)

    def write(self, path: Path) -> None:
        """Write the file; it appears under its name only when it is whole."""
        self._doc["buffers"] = [{"byteLength": self._length}]
        text = json.dumps(self._doc, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + self._length
        partial = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            with partial.open("wb") as file:
                file.write(b"glTF" + _words(2, total))
                file.write(_words(len(text)) + b"JSON" + text)
                file.write(_words(self._length) + b"BIN\0")
                for blob in self._blobs:
                    file.write(blob)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def _words(*numbers: int) -> bytes:
    return b"".join(n.to_bytes(4, "little") for n in numbers)
