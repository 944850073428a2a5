"""Walks made by hand, for tests: quads, atlas pages and near polygons in, a folder out."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import farfield_shading as shading
import numpy as np
from farfield_core.scene import Bounds
from farfield_core.walk import (
    AtlasFormat,
    CellFile,
    CellTable,
    NearBlock,
    Quads,
    Start,
    Walk,
    WalkGrid,
    WalkScene,
)
from numpy.typing import ArrayLike, NDArray
from PIL import Image


class WalkWriter:
    """A walk with one row of cubic cells along x; quads and near blocks go to the first."""

    def __init__(
        self, resolution: int = 64, cell: float = 4.0, cells: int = 1, near_field: float = 10.0
    ) -> None:
        self.resolution = resolution
        self.size = cell
        self.cells = cells
        self.near_field = near_field
        self.page_size = 256
        self.pages: list[NDArray[np.uint8]] = []
        self.eyes = [self.centre()]
        self.quads: dict[str, list[Any]] = {name: [] for name in Quads.model_fields}
        self.near: list[tuple[bytes, tuple[int, ...]]] = []
        self.images: dict[str, NDArray[np.uint8]] = {}

    def centre(self, index: int = 0) -> tuple[float, float, float]:
        """Centre of a cell."""
        return (self.size * (index + 0.5), self.size / 2, self.size / 2)

    def page(self, pixels: ArrayLike) -> int:
        """Add an atlas page, (256, 256, 4) uint8; returns its number."""
        self.pages.append(np.asarray(pixels, np.uint8))
        return len(self.pages) - 1

    def quad(
        self,
        face: int,
        corners: ArrayLike,
        plane: ArrayLike,
        page: int = 0,
        scale: float = 1.0,
        offset: ArrayLike = (0.0, 0.0),
        turned: bool = False,
        eye: int = 0,
    ) -> None:
        """Add a quad with `corners` (n, 2) in texels of its face."""
        xy = np.asarray(corners, np.float64)
        q = self.quads
        q["eyes"].append(eye)
        q["faces"].append(face)
        q["layers"].append(-1)
        q["corner_counts"].append(len(xy))
        q["corners"] += xy.ravel().tolist()
        q["planes"] += np.asarray(plane, np.float64).tolist()
        q["pages"].append(page)
        q["scales"].append(scale)
        q["offsets"] += np.asarray(offset, np.float64).tolist()
        q["turned"].append(int(turned))

    def write(self, folder: Path) -> Path:
        """Write the walk; returns its walk.json."""
        for name in ("cells", "atlases", "near"):
            (folder / name).mkdir(parents=True)
        names = tuple(f"{n:032x}.png" for n in range(len(self.pages)))
        for name, pixels in zip(names, self.pages, strict=True):
            Image.fromarray(pixels).save(folder / "atlases" / name)
        for name, pixels in self.images.items():
            Image.fromarray(pixels).save(folder / "near" / name)
        for n, (data, _) in enumerate(self.near):
            (folder / "near" / f"{n:032x}.glb").write_bytes(data)
        near = tuple(
            NearBlock.model_construct(blob=f"{n:032x}.glb", ranges=ranges)
            for n, (_, ranges) in enumerate(self.near)
        )
        # unchecked, so that faults can be written too
        cell = CellFile.model_construct(
            cell=(0, 0, 0),
            eyes=tuple(self.eyes),
            quads=Quads.model_construct(
                **{name: tuple(column) for name, column in self.quads.items()}
            ),
            atlases=names,
            near=near,
            figures={},
        )
        (folder / "cells" / "0_0_0.json").write_text(cell.model_dump_json(), encoding="utf-8")
        walk = self.manifest()
        (folder / "walk.json").write_text(walk.model_dump_json(), encoding="utf-8")
        return folder / "walk.json"

    def manifest(self) -> Walk:
        """walk.json."""
        far = Bounds(min=(-500.0, -500.0, -500.0), max=(500.0, 500.0, 500.0))
        row = range(self.cells)
        zeros = (0,) * self.cells
        light = {name: (v[0], v[1], v[2]) for name, v in shading.default_light().items()}
        return Walk(
            id="test",
            name="test",
            scene=WalkScene(id="test", name="test", triangles=1, bounds=far),
            settings={},
            resolution=self.resolution,
            layers=(),
            borders=(),
            near_field=self.near_field,
            grid=WalkGrid(
                origin=(0.0, 0.0, 0.0),
                size=(self.size, self.size, self.size),
                total=self.cells,
                cells=CellTable(i=tuple(row), j=zeros, k=zeros, y=(0.0,) * self.cells),
            ),
            atlas=AtlasFormat(width=self.page_size, height=self.page_size, encoding="png"),
            light=light,
            places={"cells": "cells/", "atlases": "atlases/", "near": "near/"},
            start=Start(eye=self.centre(), yaw=0.0, pitch=0.0),
        )


def near_glb(
    corners: ArrayLike,
    color: ArrayLike = (1.0, 1.0, 1.0, 1.0),
    material: dict[str, Any] | None = None,
    uvs: ArrayLike | None = None,
    image: str | None = None,
) -> bytes:
    """A near block of triangles (n, 3, 3) in scene coordinates, 16 bits each, flat normals."""
    p = np.asarray(corners, np.float64).reshape(-1, 3, 3)
    low = p.reshape(-1, 3).min(axis=0)
    step = max(float((p.reshape(-1, 3).max(axis=0) - low).max()), 1e-6) / 65535
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    count = 3 * len(p)
    vertices = np.zeros((count, 4), np.uint16)
    vertices[:, :3] = np.rint((p.reshape(-1, 3) - low) / step)
    bytes_ = np.zeros((count, 4), np.int8)
    bytes_[:, :3] = np.rint(np.repeat(normals, 3, axis=0) * 127)
    colors = np.broadcast_to(np.rint(np.asarray(color) * 65535).astype(np.uint16), (count, 4))
    views = [vertices, bytes_, np.ascontiguousarray(colors), np.arange(count, dtype=np.uint16)]
    accessors: list[dict[str, Any]] = [
        {"componentType": 5123, "type": "VEC3"},
        {"componentType": 5120, "type": "VEC3", "normalized": True},
        {"componentType": 5123, "type": "VEC4", "normalized": True},
        {"componentType": 5123, "type": "SCALAR"},
    ]
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}
    gltf: dict[str, Any] = {"asset": {"version": "2.0"}}
    if uvs is not None:
        views.append(np.asarray(uvs, np.float32).reshape(-1, 2))
        accessors.append({"componentType": 5126, "type": "VEC2"})
        attributes["TEXCOORD_0"] = 4
        gltf |= {"images": [{"uri": image}], "textures": [{"source": 0, "sampler": 0}]}
        gltf["samplers"] = [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]
    buffer, entries = b"", []
    for number, (view, accessor) in enumerate(zip(views, accessors, strict=True)):
        entry: dict[str, Any] = {"buffer": 0, "byteOffset": len(buffer), "byteLength": view.nbytes}
        if number < 3:
            entry["byteStride"] = view.strides[0]
        entries.append(entry)
        accessor |= {"bufferView": number, "count": count}
        buffer += view.tobytes() + b"\0" * (-view.nbytes % 4)
    gltf |= {
        "buffers": [{"byteLength": len(buffer)}],
        "bufferViews": entries,
        "accessors": accessors,
        "materials": [material or {}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
        "nodes": [{"mesh": 0, "translation": low.tolist(), "scale": [step] * 3}],
    }
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def cast_quads(
    writer: WalkWriter, eye: NDArray[np.float64], directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Cast rays at a writer's quads: distances (n,), inf at infinity and nan where nothing is hit,
    and colours (n, 3). The slow way: each ray with each quad's plane, inside its corners?
    """
    from farfield_core.faces import FACES

    q = writer.quads
    best = np.full(len(directions), np.nan)
    color = np.zeros((len(directions), 3), np.uint8)
    at = 0
    for n, count in enumerate(q["corner_counts"]):
        corners = np.reshape(q["corners"][2 * at : 2 * (at + count)], (-1, 2))
        at += count
        _, right, down, forward = FACES[q["faces"][n]]
        a, b, c = q["planes"][3 * n : 3 * n + 3]
        normal = a * right + b * down + c * forward  # points p with normal . (p - eye) = 1
        offset = eye - np.asarray(writer.eyes[q["eyes"][n]])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (1.0 - offset @ normal) / (directions @ normal)
            infinite = np.isinf(t)
            point = np.where(infinite[:, None], directions, offset + directions * t[:, None])
            z = point @ forward
            x = ((point @ right) / z + 1) * writer.resolution / 2
            y = ((point @ down) / z + 1) * writer.resolution / 2
        inside = (z > 0) & ((t > 0) | infinite)
        ends = np.roll(corners, -1, axis=0)
        turns = [
            (e[0] - s[0]) * (y - s[1]) - (e[1] - s[1]) * (x - s[0])
            for s, e in zip(corners, ends, strict=True)
        ]
        inside &= np.all([turn >= 0 for turn in turns], axis=0) | np.all(
            [turn <= 0 for turn in turns], axis=0
        )
        s, r = (y, x) if q["turned"][n] else (x, y)
        page = writer.pages[q["pages"][n]]
        limit = writer.page_size - 1
        column = np.clip(np.floor(q["scales"][n] * s + q["offsets"][2 * n]), 0, limit)
        row = np.clip(np.floor(q["scales"][n] * r + q["offsets"][2 * n + 1]), 0, limit)
        texel = page[np.nan_to_num(row).astype(int), np.nan_to_num(column).astype(int)]
        inside &= texel[:, 3] >= 128
        nearer = inside & ~(t >= best)
        best[nearer], color[nearer] = t[nearer], texel[nearer, :3]
    return best, color
