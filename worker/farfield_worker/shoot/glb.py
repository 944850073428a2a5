"""A reader for the glTF binaries that near blocks are (docs/format.md, "Near blocks").

It keeps what general mesh loaders change: the order of triangles, quantised positions, and the
index ranges that cells refer to.
"""

from __future__ import annotations

import json
import struct
from typing import Any, Literal, NamedTuple, NoReturn

import meshoptimizer
import numpy as np
from farfield_core.errors import BadInputError
from numpy.typing import NDArray

from farfield_worker.gl.material import Features

_COMPONENTS: dict[int, type[np.generic]] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_WRAPS: dict[int, Literal["repeat", "clamp", "mirror"]] = {
    10497: "repeat",
    33071: "clamp",
    33648: "mirror",
}


class NearTexture(NamedTuple):
    """A texture of a near block: a file beside it and how it is sampled."""

    file: str
    wrap_u: Literal["repeat", "clamp", "mirror"]
    wrap_v: Literal["repeat", "clamp", "mirror"]
    filter: Literal["linear", "nearest"]


class Material(NamedTuple):
    """A draw state; primitives with equal materials can be drawn together."""

    texture: NearTexture | None
    emissive_texture: NearTexture | None
    emissive: tuple[float, float, float]
    alpha: Literal["opaque", "mask", "dither"]
    cutoff: float
    double_sided: bool
    unlit: bool

    @property
    def features(self) -> Features:
        """What its program must do."""
        return Features(
            self.texture is not None,
            self.emissive_texture is not None,
            self.alpha,
            self.double_sided,
            self.unlit,
        )


class Primitive(NamedTuple):
    """Triangles of one material.

    Attributes:
        positions: (n, 3) float64, scene coordinates.
        normals: (n, 4) int8, unit normals times 127, last component 0.
        uvs: (n, 2) float32.
        colors: (n, 4) uint16, linear, times 65535.
        triangles: (m, 3) uint32.
    """

    material: Material
    positions: NDArray[np.float64]
    normals: NDArray[np.int8]
    uvs: NDArray[np.float32]
    colors: NDArray[np.uint16]
    triangles: NDArray[np.uint32]


def read_near_block(data: bytes) -> list[Primitive]:
    """Read a near block; raises BadInputError for anything docs/format.md does not describe."""
    gltf, binary = _chunks(data)
    try:
        node = next(n for n in gltf["nodes"] if "mesh" in n)
        if "rotation" in node or "matrix" in node:
            _refuse("its node is more than moved and scaled")
        return [
            _primitive(gltf, binary, node, primitive)
            for primitive in gltf["meshes"][node["mesh"]]["primitives"]
        ]
    except (KeyError, IndexError, TypeError, ValueError, StopIteration) as error:
        _refuse(f"it is not well-formed glTF ({error!r})")


def _refuse(reason: str) -> NoReturn:
    raise BadInputError(f"A near block of the walk cannot be read: {reason}; bake the walk anew.")


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and binary parts of a GLB."""
    if len(data) < 20 or data[:4] != b"glTF":
        _refuse("it is not a glTF binary")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2 or length > len(data):
        _refuse("it is cut short or of another version")
    parts = {b"JSON": b"", b"BIN\0": b""}
    at = 12
    while at + 8 <= length:
        (size,) = struct.unpack_from("<I", data, at)
        if at + 8 + size > length:
            _refuse("it is cut short")
        parts[data[at + 4 : at + 8]] = data[at + 8 : at + 8 + size]
        at += 8 + size
    try:
        gltf = json.loads(parts[b"JSON"])
    except ValueError:
        _refuse("its JSON part is not JSON")
    if not isinstance(gltf, dict):
        _refuse("its JSON part is not an object")
    return gltf, parts[b"BIN\0"]


def _accessor(gltf: dict[str, Any], binary: bytes, number: int) -> NDArray[Any]:
    """Values of an accessor, (count, width): floats where it is float or normalised."""
    accessor = gltf["accessors"][number]
    view, binary = _view(gltf, binary, gltf["bufferViews"][accessor["bufferView"]])
    kind, width = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
    stride = view.get("byteStride", kind.itemsize * width)
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    values = np.ndarray(
        (accessor["count"], width), kind, binary, start, (stride, kind.itemsize)
    ).copy()
    if accessor.get("normalized", False):
        return np.maximum(values / np.iinfo(kind).max, -1.0)
    return values


def _view(
    gltf: dict[str, Any], binary: bytes, view: dict[str, Any]
) -> tuple[dict[str, Any], bytes]:
    """A buffer view and the bytes that it is a part of; packed triangles are unpacked."""
    packed = view.get("extensions", {}).get("EXT_meshopt_compression")
    if packed is None:
        return view, binary
    count, stride, start = packed["count"], packed["byteStride"], packed.get("byteOffset", 0)
    data = binary[start : start + packed["byteLength"]]
    # a packed triangle takes a byte at least
    if packed["mode"] != "TRIANGLES" or stride not in (2, 4) or not 0 <= count <= 3 * len(data):
        _refuse("its buffers are packed in a way that is not known")
    try:
        indices = meshoptimizer.decode_index_buffer(count, 4, data)
    except RuntimeError:
        _refuse("its triangles are damaged")
    return {}, indices.astype(f"<u{stride}").tobytes()


def _primitive(
    gltf: dict[str, Any], binary: bytes, node: dict[str, Any], primitive: dict[str, Any]
) -> Primitive:
    if primitive.get("mode", 4) != 4:
        _refuse("it holds something else than triangles")
    attributes = primitive["attributes"]
    stored = _accessor(gltf, binary, attributes["POSITION"]).astype(np.float64)
    count = len(stored)
    positions = stored * node.get("scale", (1.0, 1.0, 1.0)) + node.get("translation", (0.0,) * 3)
    normals = np.zeros((count, 4), np.int8)
    if "NORMAL" in attributes:
        normals[:, :3] = np.rint(_accessor(gltf, binary, attributes["NORMAL"])[:, :3] * 127)
    uvs = np.zeros((count, 2), np.float32)
    if "TEXCOORD_0" in attributes:
        uvs[:] = _accessor(gltf, binary, attributes["TEXCOORD_0"])
    colors = np.full((count, 4), 65535, np.uint16)
    if "COLOR_0" in attributes:
        given = _accessor(gltf, binary, attributes["COLOR_0"])
        colors[:, : given.shape[1]] = np.rint(given * 65535)
    indices = _accessor(gltf, binary, primitive["indices"])
    if len(indices) % 3 or (len(indices) and int(indices.max()) >= count):
        _refuse("its triangles refer to vertices that are not there")
    return Primitive(
        _material(gltf, primitive.get("material")),
        positions,
        normals,
        uvs,
        colors,
        indices.astype(np.uint32).reshape(-1, 3),
    )


def _material(gltf: dict[str, Any], number: int | None) -> Material:
    material = {} if number is None else gltf["materials"][number]
    extensions = material.get("extensions", {})
    alpha: Literal["opaque", "mask", "dither"] = "opaque"
    if material.get("extras", {}).get("alpha") == "dither":
        alpha = "dither"
    elif material.get("alphaMode", "OPAQUE") == "MASK":
        alpha = "mask"
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    red, green, blue = (strength * c for c in material.get("emissiveFactor", (0.0, 0.0, 0.0)))
    pbr = material.get("pbrMetallicRoughness", {})
    return Material(
        _texture(gltf, pbr.get("baseColorTexture")),
        _texture(gltf, material.get("emissiveTexture")),
        (red, green, blue),
        alpha,
        material.get("alphaCutoff", 0.5),
        material.get("doubleSided", False),
        "KHR_materials_unlit" in extensions,
    )


def _texture(gltf: dict[str, Any], info: dict[str, Any] | None) -> NearTexture | None:
    if info is None:
        return None
    texture = gltf["textures"][info["index"]]
    sampler = gltf["samplers"][texture["sampler"]] if "sampler" in texture else {}
    return NearTexture(
        gltf["images"][texture["source"]]["uri"],
        _WRAPS[sampler.get("wrapS", 10497)],
        _WRAPS[sampler.get("wrapT", 10497)],
        "nearest" if sampler.get("magFilter") == 9728 else "linear",
    )
