"""glTF 2.0: GLB, and glTF with its files beside it.

Read here rather than through trimesh, which draws every instance's mesh in float64, forgets texture
coordinate sets, texture transforms and unlit materials, and reads neither EXT_meshopt_compression
nor EXT_mesh_gpu_instancing; tests hold this reader against trimesh wherever both can read a file.
"""

from __future__ import annotations

import numpy as np

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.gltf.accessors import Accessors
from farfield_worker.prepare.gltf.document import Document
from farfield_worker.prepare.gltf.materials import read_materials
from farfield_worker.prepare.gltf.nodes import placed_meshes
from farfield_worker.prepare.gltf.primitives import Primitives
from farfield_worker.prepare.gltf.textures import Textures
from farfield_worker.prepare.limits import Limits
from farfield_worker.prepare.model import Mesh, Model

#: extensions that a file may require; what they add is read, or does not show in diffuse light
SUPPORTED = {
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
}


def read_gltf(folder: ModelFolder, limits: Limits) -> Model:
    """Read the glTF at `folder.model`; raises SceneRefusedError."""
    document = Document(folder, limits)
    for name in document.json.get("extensionsRequired", []):
        if name not in SUPPORTED and not str(name).startswith("KHR_materials_"):
            document.refuse(f"it requires the extension {name}, which is not supported")
    for kind in ("animations", "skins"):
        if document.json.get(kind):
            document.note(f"The model's {kind} were left out: scenes stand still.")
    accessors = Accessors(document)
    materials = read_materials(Textures(accessors))
    primitives = Primitives(accessors, materials)

    meshes: list[Mesh] = []
    parts: dict[int, list[int]] = {}
    placed: list[np.ndarray] = []
    matrices: list[np.ndarray] = []
    shapes: list[np.ndarray] = []
    copies: list[np.ndarray] = []
    triangles = standing = 0
    for index, worlds in placed_meshes(accessors):
        if index not in parts:
            parts[index] = []
            for primitive in document.item("meshes", index).get("primitives", []):
                mesh = primitives.read(primitive)
                if mesh is not None:
                    parts[index].append(len(meshes))
                    meshes.append(mesh)
        for part in parts[index]:
            triangles += len(meshes[part].triangles) * len(worlds)
            placed.append(np.full(len(worlds), part, np.int32))
            matrices.append(worlds)
            shapes.append(np.full(len(worlds), index, np.int32))
            copies.append(np.arange(standing, standing + len(worlds), dtype=np.int32))
        standing += len(worlds)
        if triangles > limits.triangles:
            document.refuse(f"it has more than {limits.triangles} triangles")
    if not placed:
        document.refuse("it holds no triangles")
    return Model(
        meshes,
        materials,
        np.concatenate(placed),
        np.concatenate(matrices),
        document.notes,
        np.concatenate(shapes),
        np.concatenate(copies),
    )
