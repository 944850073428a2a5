"""Small glTF files made by hand, and what a prepared scene holds as plain triangles."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core.scene import PreparedScene, open_scene
from farfield_worker.prepare import prepare
from PIL import Image

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "f4")
QUAD_TRIANGLES = np.array([0, 1, 2, 0, 2, 3], "u2")
QUAD_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "f4")
UP_Z = np.tile(np.array([0, 0, 1], "f4"), (4, 1))


class Gltf:
    """Collects the parts of a glTF; `root` may be changed at will before it is written."""

    def __init__(self) -> None:
        self.body = bytearray()
        self.root: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        entries = self.root.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def view(self, data: bytes, **extra: Any) -> int:
        self.body += bytes(-len(self.body) % 4)
        start = len(self.body)
        self.body += data
        entry = {"buffer": 0, "byteOffset": start, "byteLength": len(data), **extra}
        return self.add("bufferViews", entry)

    def accessor(self, array: np.ndarray, view: int | None = None, **extra: Any) -> int:
        rows = array.reshape(len(array), -1)
        entry: dict[str, Any] = {
            "componentType": COMPONENTS[rows.dtype.str[1:]],
            "count": len(rows),
            "type": SHAPES[rows.shape[1]],
            "bufferView": self.view(rows.tobytes()) if view is None else view,
        }
        return self.add("accessors", entry | extra)

    def mesh(self, *primitives: dict[str, Any]) -> int:
        return self.add("meshes", {"primitives": list(primitives)})

    def node(self, top: bool = True, **node: Any) -> int:
        index = self.add("nodes", node)
        if top:
            self.root["scenes"][0]["nodes"].append(index)
        return index

    def quad(self, material: int | None = None, **attributes: np.ndarray | int) -> dict[str, Any]:
        """A primitive: the unit square facing +z; attributes are arrays or accessors."""
        given = {"POSITION": QUAD} | attributes
        primitive: dict[str, Any] = {
            "attributes": {
                name: value if isinstance(value, int) else self.accessor(value)
                for name, value in given.items()
            },
            "indices": self.accessor(QUAD_TRIANGLES),
        }
        if material is not None:
            primitive["material"] = material
        return primitive

    def texture(self, pixels: np.ndarray, **sampler: int) -> int:
        image = self.add("images", {"bufferView": self.view(png(pixels)), "mimeType": "image/png"})
        texture = {"source": image}
        if sampler:
            texture["sampler"] = self.add("samplers", sampler)
        return self.add("textures", texture)

    def glb(self) -> bytes:
        body = bytes(self.body) + bytes(-len(self.body) % 4)
        root = self.root | ({"buffers": [{"byteLength": len(body)}]} if body else {})
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body)),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(body), b"BIN\0"),
                body,
            ]
        )

    def write(self, folder: Path) -> Path:
        path = folder / "model.glb"
        path.write_bytes(self.glb())
        return path


def one_quad(material: dict[str, Any] | None = None, **attributes: np.ndarray) -> Gltf:
    """A glTF of one square with one material."""
    gltf = Gltf()
    number = None if material is None else gltf.add("materials", material)
    gltf.node(mesh=gltf.mesh(gltf.quad(number, **attributes)))
    return gltf


def png(pixels: np.ndarray) -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(out, "PNG")
    return out.getvalue()


def flat_color(r: int, g: int, b: int, a: int = 255, size: int = 2) -> np.ndarray:
    return np.tile(np.array([r, g, b, a], np.uint8), (size, size, 1))


def prepared(source: Path | Gltf, folder: Path) -> PreparedScene:
    path = source.write(folder) if isinstance(source, Gltf) else source
    prepare(path, folder / "prepared", "s", "A scene", pictures=False)
    return open_scene(folder / "prepared")


@dataclass(frozen=True)
class Soup:
    """Every corner of every triangle of a prepared scene, and each triangle's batch."""

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    colors: np.ndarray
    batch: np.ndarray


def soup(scene: PreparedScene) -> Soup:
    corners = np.asarray(scene.triangles)
    batch = np.full(len(corners), -1)
    for block in scene.info.blocks:
        for part in block.parts:
            batch[part.first_triangle : part.first_triangle + part.triangles] = part.batch
    return Soup(
        scene.positions[corners].astype(np.float64) + scene.origin,
        scene.normals[corners].astype(np.float64)[..., :3] / 127,
        np.asarray(scene.uvs[corners]),
        scene.colors[corners].astype(np.float64) / 65535,
        batch,
    )


def facing(triangles: np.ndarray) -> np.ndarray:
    """Unit normals of the winding of (m, 3, 3) triangles."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def canonical(triangles: np.ndarray, digits: int = 3) -> list[tuple[float, ...]]:
    """Triangles (m, 3, 3) as a sorted list that forgets their order and first corner only."""
    out = []
    for triangle in np.round(triangles, digits) + 0.0:
        turns = [np.roll(triangle, -k, axis=0).ravel().tolist() for k in range(3)]
        out.append(tuple(min(turns)))
    return sorted(out)
