"""PLY, parsed by trimesh after its header has been checked against the file's size."""

from __future__ import annotations

import re
from typing import BinaryIO

import numpy as np
from trimesh.exchange.ply import load_ply

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.images import Picture, UnreadablePictureError, measure
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.model import Material, Mesh, Model, TextureUse, one_of_each
from farfield_worker.prepare.obj import fan, srgb_colors

_SIZES = {
    "char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8,
    "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4,
    "float64": 8,
}  # fmt: skip
_LONGEST_HEADER = 1 << 20


def read_ply(folder: ModelFolder, limits: Limits) -> Model:
    """Read the PLY at `folder.model`, double-sided, colours sRGB; raises SceneRefusedError."""
    notes: list[str] = []
    with folder.model.open("rb") as file:
        header = check_header(folder, file)
        file.seek(0)
        try:
            loaded = load_ply(file, skip_materials=True)
        except ValueError as error:
            if "unexpected length" not in str(error):
                raise
            cause = "it is cut off, or its faces have different numbers of corners: triangulate it"
            refuse(folder.name, cause)
    if loaded.get("vertices") is None or loaded.get("faces") is None:
        refuse(folder.name, "it holds no triangles")
    positions = np.asarray(loaded["vertices"], np.float64)
    faces = fan(np.asarray(loaded["faces"], np.int64))
    if len(faces) and (faces.min() < 0 or faces.max() >= len(positions)):
        refuse(folder.name, "its faces point beyond its vertices")
    uv = getattr(loaded.get("visual"), "uv", None)
    uvs = None
    if uv is not None and len(uv) == len(positions):
        uvs = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]).astype(np.float32)
    mesh = Mesh(
        positions.astype(np.float32),
        faces.astype(np.uint32),
        0,
        _fitting(loaded.get("vertex_normals"), len(positions)),
        uvs,
        srgb_colors(_fitting(loaded.get("vertex_colors"), len(positions), keep_type=True)),
    )
    colors = loaded.get("face_colors")
    if mesh.colors is None and colors is not None and len(colors) == len(faces):
        mesh = _per_face(mesh, colors)
    blend = mesh.colors is not None and bool((mesh.colors[:, 3] < 65535).any())
    material = Material(
        "ply",
        _texture(folder, header, limits, notes) if uvs is not None else None,
        alpha="blend" if blend else "opaque",
        double_sided=True,
    )
    return one_of_each([mesh], [material], notes)


def check_header(folder: ModelFolder, file: BinaryIO) -> str:
    """Return the header; refuses counts that the rest of the file cannot hold."""
    head = file.read(_LONGEST_HEADER)
    match = re.match(rb"ply\s.*?^end_header\r?\n", head, re.DOTALL | re.MULTILINE)
    if match is None:
        refuse(folder.name, "it has no PLY header")
    header = match[0].decode("ascii", "replace")
    rest = file.seek(0, 2) - match.end()
    ascii_body = re.search(r"^format\s+ascii", header, re.MULTILINE) is not None
    needed, count = 0, 0
    for line in header.splitlines():
        words = line.split()
        if len(words) >= 3 and words[0] == "element":
            if not words[2].isdigit():
                refuse(folder.name, f"its header counts {words[2][:20]!r} elements")
            count = int(words[2])
        elif len(words) >= 3 and words[0] == "property":
            kind = words[2] if words[1] == "list" else words[1]
            if kind not in _SIZES:
                refuse(folder.name, f"its header has the unknown type {kind[:20]!r}")
            # a list may be empty, so only its length is sure to be there; a number in text takes
            # a digit and a separator
            needed += count * (2 if ascii_body else _SIZES[kind])
    if needed > rest + 1:
        refuse(folder.name, f"its header promises at least {needed} bytes and {rest} are there")
    return header


def _fitting(column: object, count: int, keep_type: bool = False) -> np.ndarray | None:
    if column is None:
        return None
    array = np.asarray(column)
    if len(array) != count:
        return None
    return array if keep_type else array.astype(np.float32)


def _per_face(mesh: Mesh, colors: np.ndarray) -> Mesh:
    corners = mesh.triangles.reshape(-1)
    return Mesh(
        mesh.positions[corners],
        np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        0,
        None if mesh.normals is None else mesh.normals[corners],
        None if mesh.uvs is None else mesh.uvs[corners],
        srgb_colors(np.repeat(colors, 3, axis=0)),
    )


def _texture(
    folder: ModelFolder, header: str, limits: Limits, notes: list[str]
) -> TextureUse | None:
    match = re.search(r"^comment\s+TextureFile\s+([^\r\n]+)", header, re.MULTILINE | re.IGNORECASE)
    if match is None:
        return None
    name = match[1].strip()
    path = folder.find(name, is_uri=False)
    if path is None:
        notes.append(f"The texture {name[:80]!r} is missing.")
        return None
    picture = Picture(name[:80], path)
    try:
        measure(picture, folder.name, limits)
    except UnreadablePictureError:
        notes.append(f"The texture {name[:80]!r} cannot be read.")
        return None
    return TextureUse(picture)
