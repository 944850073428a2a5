"""A near block by hand: quantised boxes, one primitive for every way of drawing near polygons."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

TRANSLATION = np.array([-8.0, -4.0, -8.0])
SPAN = 48.0

#: name, centre, half extents, colour (linear RGBA), material
BOXES: tuple[tuple[str, Any, Any, Any, dict[str, Any]], ...] = (
    ("opaque", (9.0, 1.5, -2.5), (0.7, 2.0, 0.5), (0.6, 0.3, 0.2, 1.0), {}),
    (
        "textured",
        (2.0, 1.0, -3.0),
        (0.8, 1.2, 0.4),
        (1.0, 1.0, 1.0, 1.0),
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
    ),
    (
        "mask",
        (5.0, 1.6, -4.0),
        (1.0, 1.0, 0.05),
        (0.2, 0.8, 0.3, 1.0),
        {
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}},
            "alphaMode": "MASK",
            "alphaCutoff": 0.4,
            "doubleSided": True,
        },
    ),
    (
        "dither",
        (3.5, 2.0, -1.0),
        (0.5, 0.6, 0.3),
        (0.3, 0.5, 0.9, 0.45),
        {"alphaMode": "BLEND", "extras": {"alpha": "dither"}, "doubleSided": True},
    ),
    (
        "unlit",
        (6.5, 0.8, -3.2),
        (0.4, 0.4, 0.4),
        (0.9, 0.2, 0.7, 1.0),
        {"extensions": {"KHR_materials_unlit": {}}},
    ),
    (
        "emissive",
        (0.5, 2.4, -2.0),
        (0.3, 0.5, 0.3),
        (0.1, 0.1, 0.1, 1.0),
        {"emissiveFactor": [0.4, 0.25, 0.05]},
    ),
    ("long", (4.0, -1.0, 0.0), (14.0, 0.3, 14.0), (0.35, 0.4, 0.3, 1.0), {}),
)


def box(
    centre: NDArray[np.float64], half: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.float32], NDArray[np.uint16]]:
    """Positions (24, 3), normals (24, 4), uvs (24, 2) and triangles (12, 3), outward facing."""
    positions, normals, uvs, triangles = [], [], [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            a, b = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            normal = sign * np.eye(3)[axis]
            first = len(positions)
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append(centre + half * (normal + s * a + t * b))
                normals.append([*(127 * normal), 0])
                # Few repetitions a metre: magnified everywhere, so that no mipmap is involved.
                uvs.append([0.6 * s * (half @ a), 0.6 * t * (half @ b)])
            order = [0, 1, 2, 0, 2, 3] if sign > 0 else [0, 2, 1, 0, 3, 2]
            triangles.extend(first + n for n in order)
    return (
        np.array(positions),
        np.array(normals, np.int8),
        np.array(uvs, np.float32),
        np.array(triangles, np.uint16).reshape(-1, 3),
    )


def quantise(positions: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Positions in units of SPAN / 65535 from TRANSLATION."""
    return np.round((positions - TRANSLATION) / SPAN * 65535).astype(np.uint16)


def texture_pixels(size: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Two images of `size` texels a side: colours, and a pattern of opacities."""
    x, y = np.meshgrid(np.arange(size) & 3, np.arange(size) & 3)
    colors = np.stack([60 * x + 30, 60 * y + 30, 40 * (x ^ y) + 60, 0 * x + 255], axis=-1)
    holes = np.stack([0 * x + 240, 255 - 20 * x, 200 + 10 * y, 255 * ((x + y) & 1)], axis=-1)
    return colors.astype(np.uint8), holes.astype(np.uint8)


def png(pixels: NDArray[np.uint8]) -> bytes:
    """PNG file of RGBA pixels."""
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, format="PNG")
    return buffer.getvalue()


def near_block(write: Callable[[bytes, str], str], smooth: bool) -> tuple[str, list[int]]:
    """Write the block and its textures; return its name and triangles per primitive.

    Its textures have 4 texels a side and show them as squares, or, if it is to be `smooth`, 64
    texels that are filtered and mipmapped.
    """
    pictures = texture_pixels(64 if smooth else 4)
    images = [{"uri": write(png(pixels), ".png")} for pixels in pictures]
    sampler = {"wrapS": 10497, "wrapT": 33648}
    if not smooth:
        sampler |= {"magFilter": 9728, "minFilter": 9986}
    data = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def accessor(array: NDArray[Any], kind: str, component: int, **more: Any) -> int:
        data.extend(b"\0" * (-len(data) % 4))
        stride = {} if kind == "SCALAR" else {"byteStride": array.strides[0]}
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes, **stride})
        data.extend(array.tobytes())
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": array.size if kind == "SCALAR" else len(array),
                "type": kind,
                **more,
            }
        )
        return len(accessors) - 1

    primitives = []
    materials = []
    counts = []
    for name, centre, half, color, material in BOXES:
        positions, normals, uvs, triangles = box(np.array(centre), np.array(half))
        padded = np.zeros((len(positions), 4), np.uint16)
        padded[:, :3] = quantise(positions)
        colors = np.tile(np.round(np.array(color) * 65535).astype(np.uint16), (len(positions), 1))
        attributes = {
            "POSITION": accessor(padded, "VEC3", 5123),
            "NORMAL": accessor(normals, "VEC3", 5120, normalized=True),
            "COLOR_0": accessor(colors, "VEC4", 5123, normalized=True),
        }
        if "pbrMetallicRoughness" in material:
            attributes["TEXCOORD_0"] = accessor(uvs, "VEC2", 5126)
        primitives.append(
            {
                "attributes": attributes,
                "indices": accessor(triangles.ravel(), "SCALAR", 5123),
                "material": len(materials),
            }
        )
        materials.append({"name": name, **material})
        counts.append(len(triangles))
    gltf = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_mesh_quantization", "KHR_materials_unlit"],
        "extensionsRequired": ["KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "mesh": 0,
                "translation": TRANSLATION.tolist(),
                "scale": [SPAN / 65535] * 3,
            }
        ],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
        "images": images,
        "samplers": [sampler],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    data.extend(b"\0" * (-len(data) % 4))
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(data), 0x004E4942) + bytes(data)
    return write(struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body, ".glb"), counts
