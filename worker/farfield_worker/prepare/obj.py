"""Wavefront OBJ, parsed by trimesh; its materials by mtl.py."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
from farfield_shading import to_linear
from numpy.typing import NDArray
from trimesh.exchange.obj import load_obj

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.model import Material, Mesh, Model, one_of_each
from farfield_worker.prepare.mtl import WHITE, MaterialFile


def read_obj(folder: ModelFolder, limits: Limits) -> Model:
    """Read the OBJ at `folder.model`; raises SceneRefusedError."""
    notes: list[str] = []
    text = folder.model.read_bytes()
    if re.search(rb"^f [^\n]*-\d", text, re.MULTILINE):
        text = absolute_indices(text)
    if re.search(rb"^(l|p) ", text, re.MULTILINE):
        notes.append("Lines and points were left out.")
    library = MaterialFile(folder, limits, notes)
    for line in dict.fromkeys(re.findall(rb"^mtllib[ \t]+([^\r\n]+)", text, re.MULTILINE)):
        library.read(line.decode("utf-8", "replace").strip())
    library.close()
    used = dict.fromkeys(re.findall(rb"^usemtl[ \t]+([^\r\n]+)", text, re.MULTILINE))
    names = [line.decode("utf-8", "replace").strip() for line in used]
    # bare names, so that trimesh groups by them and opens nothing
    stub = "".join(f"newmtl {name}\nillum 1\n" for name in names)
    loaded = load_obj(io.BytesIO(b"mtllib names\n" + text), {"names": stub.encode()})
    parts = list(loaded.get("geometry", {}).values())
    if not parts:
        refuse(folder.name, "it holds no triangles")

    materials: list[Material] = []
    index: dict[str, int] = {}
    meshes = []
    for part in parts:
        name = getattr(getattr(part["visual"], "material", None), "name", None) or ""
        if name not in index:
            index[name] = len(materials)
            materials.append(library.materials.get(name, WHITE))
        meshes.append(_mesh(part, index[name], materials[index[name]]))
    unknown = sum(1 for name in index if name and name not in library.materials)
    if unknown:
        notes.append(f"{unknown} materials are not described; they are white.")
    return one_of_each(meshes, materials, notes)


def _mesh(part: dict[str, Any], index: int, material: Material) -> Mesh:
    faces = fan(np.asarray(part["faces"], np.int64))
    positions = np.asarray(part["vertices"], np.float64)
    if len(faces) and (faces.min() < 0 or faces.max() >= len(positions)):
        raise IndexError("face index")
    normals, uv = part.get("vertex_normals"), getattr(part["visual"], "uv", None)
    uvs = None
    if uv is not None and len(uv) == len(positions):
        uvs = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
        use = material.base or material.emissive_texture
        if use is not None and use.transform is not None:
            matrix = np.array(use.transform)
            uvs = uvs @ matrix[:, :2].T + matrix[:, 2]
    return Mesh(
        positions.astype(np.float32),
        faces.astype(np.uint32),
        index,
        None if normals is None else np.asarray(normals, np.float32),
        None if uvs is None else uvs.astype(np.float32),
        srgb_colors(part.get("vertex_colors")),
    )


def fan(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (m, 3) of polygons (k, corners >= 3), as fans around each first corner."""
    if polygons.shape[1] == 3:
        return polygons
    corners = polygons.shape[1]
    return np.concatenate([polygons[:, [0, c, c + 1]] for c in range(1, corners - 1)])


def srgb_colors(colors: Any) -> NDArray[np.uint16] | None:
    """Linear uint16 RGBA of sRGB vertex colours, (n, 3|4) integers or floats."""
    if colors is None:
        return None
    given = np.asarray(colors)
    if given.ndim != 2 or given.shape[1] < 3:
        return None
    value = np.nan_to_num(given.astype(np.float64), nan=1.0)
    if given.dtype.kind in "iu":
        value /= np.iinfo(given.dtype).max
    elif len(value) and value.max() > 1.5:
        value /= 255
    out = np.full((len(value), 4), 65535, np.uint16)
    out[:, :3] = np.rint(to_linear(np.clip(value[:, :3], 0, 1)) * 65535)
    if value.shape[1] > 3:
        out[:, 3] = np.rint(np.clip(value[:, 3], 0, 1) * 65535)
    return out


def absolute_indices(text: bytes) -> bytes:
    """Rewrite face lines that count backwards from the latest vertex to count from the first."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    lines = []
    for line in text.splitlines():
        words = line.split()
        if words and words[0] in counts:
            counts[words[0]] += 1
        elif words and words[0] == b"f":
            have = (counts[b"v"], counts[b"vt"], counts[b"vn"])
            line = b" ".join([b"f", *(_absolute(word, have) for word in words[1:])])  # noqa: PLW2901
        lines.append(line)
    return b"\n".join(lines)


def _absolute(corner: bytes, have: tuple[int, int, int]) -> bytes:
    fields = []
    for field, count in zip(corner.split(b"/"), have, strict=False):
        number = int(field) if field else 0
        fields.append(b"%d" % (number + count + 1) if number < 0 else field)
    return b"/".join(fields)
