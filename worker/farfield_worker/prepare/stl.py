"""STL, binary and ASCII, parsed by trimesh, which checks the triangle count against the file."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
from trimesh.exchange.stl import load_stl

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.model import Material, Mesh, Model, one_of_each


def read_stl(folder: ModelFolder, limits: Limits) -> Model:
    """Read the STL at `folder.model`: flat, white and double-sided; raises SceneRefusedError."""
    with folder.model.open("rb") as file:
        _check_size(folder, file)
        loaded = load_stl(file)
    solids = [loaded] if "vertices" in loaded else list(loaded.get("geometry", {}).values())
    meshes = []
    for solid in solids:
        positions = np.asarray(solid["vertices"], np.float32).reshape(-1, 3)
        triangles = np.arange(len(positions), dtype=np.uint32).reshape(-1, 3)
        meshes.append(Mesh(positions, triangles, 0))
    if sum(len(mesh.triangles) for mesh in meshes) > limits.triangles:
        refuse(folder.name, f"it has more than {limits.triangles} triangles")
    return one_of_each(meshes, [Material("stl", double_sided=True)], [])


def _check_size(folder: ModelFolder, file: BinaryIO) -> None:
    """Refuse a binary STL whose size is not what its triangle count makes; rewinds the file."""
    head = file.read(84)
    if len(head) < 15:
        refuse(folder.name, "the file is too short")
    size = file.seek(0, 2)
    file.seek(0)
    count = int.from_bytes(head[80:84], "little")
    if not head.lstrip().startswith(b"solid") and size != 84 + 50 * count:
        refuse(folder.name, f"its header promises {count} triangles, which its size does not fit")
