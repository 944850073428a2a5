"""Near blocks as files: one GLB per spatial block of the scene (docs/format.md, "Near blocks")."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from farfield_core.errors import AlreadyExistsError
from farfield_core.layout import near_key
from farfield_core.object_file import ObjectFile
from farfield_core.scene import Batch, PreparedScene
from farfield_core.validation import parse
from numpy.typing import NDArray

from farfield_worker.near.glb import ARRAY_BUFFER, PACKED, GlbWriter
from farfield_worker.near.quantise import common_step, quantise
from farfield_worker.near.textures import near_texture

_WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
_MAG = {"linear": 9729, "nearest": 9728}
_MIN = {"linear": 9987, "nearest": 9984}


class NearBlocks:
    """Writes the near blocks of a scene when they are first asked for.

    Blocks are a function of the prepared scene alone: every process that makes one makes the same
    bytes under the same name. `put` stores bytes under a key of farfield_core.layout; it may raise
    AlreadyExistsError, which is as good as success.
    """

    def __init__(self, scene: PreparedScene, put: Callable[[str, bytes], None]) -> None:
        self._scene = scene
        self._put = put
        self._names: dict[int, str] = {}
        self._images: dict[int, str] = {}
        self._shapes: set[str] = set()
        self._step = common_step(scene.info)

    def blob(self, block: int) -> str:
        """Name of a block's GLB; it and its textures are in the store when this returns."""
        if block not in self._names:
            data = self._build(block)
            name = hashlib.sha256(data).hexdigest()[:32] + ".glb"
            self._store(name, data)
            self._names[block] = name
        return self._names[block]

    def _shape(self, number: int) -> str:
        """Name of the file of an object that repeats; it and its picture are in the store."""
        assert self._scene.repeats is not None
        name = self._scene.repeats.shapes[number]
        if name not in self._shapes:
            folder = self._scene.folder / "objects"
            data = (folder / name).read_bytes()
            file = parse(ObjectFile, data, f"The object {name}")
            image = file.image
            self._store(image, (folder / image).read_bytes())
            self._store(name, data)
            self._shapes.add(name)
        return name

    def _store(self, name: str, data: bytes) -> None:
        with suppress(AlreadyExistsError):
            self._put(near_key(name), data)

    def _image(self, texture: int) -> str:
        if texture not in self._images:
            entry = self._scene.info.textures[texture]
            name, data = near_texture(self._scene.folder / "textures" / entry.file)
            self._store(name, data)
            self._images[texture] = name
        return self._images[texture]

    def _build(self, index: int) -> bytes:
        scene, info = self._scene, self._scene.info
        block = info.blocks[index]
        rows = slice(block.first_vertex, block.first_vertex + block.vertices)
        batches = [info.batches[part.batch] for part in block.parts]
        glb = GlbWriter()

        steps, start, step = quantise(scene.positions[rows], block, self._step)
        shared = {
            "POSITION": glb.add(steps, ARRAY_BUFFER, bounds=True),
            "NORMAL": glb.add(scene.normals[rows, :3], ARRAY_BUFFER, normalized=True),
            "COLOR_0": glb.add(scene.colors[rows], ARRAY_BUFFER, normalized=True),
        }
        textured = [_is_textured(batch) for batch in batches]
        if any(textured):
            uvs, fraction = pack_uvs(scene.uvs[rows])
            uv_accessor = glb.add(uvs, ARRAY_BUFFER, normalized=fraction)
        first = block.first_triangle
        triangles = scene.triangles[first : first + block.triangles] - np.uint32(block.first_vertex)
        if block.vertices <= np.iinfo(np.uint16).max:
            triangles = triangles.astype(np.uint16)
        cuts = [(part.first_triangle - first, part.triangles) for part in block.parts]
        primitives = [
            {
                "attributes": shared | ({"TEXCOORD_0": uv_accessor} if textured[n] else {}),
                "indices": accessor,
                "material": n,
            }
            for n, accessor in enumerate(glb.add_triangles(triangles, cuts))
        ]
        objects, owners = self._objects(first, first + block.triangles)
        if objects:
            for n, accessor in enumerate(glb.add_range(owners, cuts)):
                primitives[n]["extras"] = {"owners": accessor}
        origin = np.asarray(info.origin)
        node = {
            "mesh": 0,
            "translation": (origin + start).tolist(),
            "scale": [step, step, step],
        }
        return glb.finish(
            {
                "scene": 0,
                "scenes": [{"nodes": [0]}],
                "nodes": [node],
                "meshes": [{"primitives": primitives}],
            }
            | self._looks(batches)
            | ({"extras": {"objects": objects}} if objects else {})
        )

    def _objects(self, first: int, last: int) -> tuple[dict[str, Any], NDArray[np.uint16]]:
        """Copies of objects that repeat among some triangles, by column; who owns each triangle.

        An owner is 1 + the number of a copy in the columns, or 0.
        """
        repeats, owners = self._scene.repeats, self._scene.owners
        if repeats is None or owners is None:
            return {}, np.zeros(0, np.uint16)
        shape = np.array([*repeats.shape, -1])
        whose = np.asarray(owners[first:last]).reshape(-1)
        whose = np.where(shape[whose] >= 0, whose, -1)
        here = np.unique(whose[whose >= 0])
        names = [self._shape(int(shape[copy])) for copy in here]
        shapes = list(dict.fromkeys(names))
        columns = {
            "shapes": shapes,
            "shape": [shapes.index(name) for name in names],
            "places": [x for copy in here for x in repeats.places[copy]],
            "turns": [x for copy in here for x in repeats.turns[copy]],
        }
        numbers = np.searchsorted(here, whose) + 1
        return (columns if shapes else {}), np.where(whose >= 0, numbers, 0).astype(np.uint16)

    def _looks(self, batches: list[Batch]) -> dict[str, Any]:
        """Materials, textures, samplers, images and extensions of a block."""
        used: list[int] = []
        for batch in batches:
            for texture in (batch.texture, batch.emissive_texture):
                if texture is not None and texture not in used:
                    used.append(texture)
        images = list(dict.fromkeys(self._image(texture) for texture in used))
        samplers: list[dict[str, int]] = []
        textures = []
        for texture in used:
            entry = self._scene.info.textures[texture]
            sampler = {
                "wrapS": _WRAPS[entry.wrap_u],
                "wrapT": _WRAPS[entry.wrap_v],
                "magFilter": _MAG[entry.filter],
                "minFilter": _MIN[entry.filter],
            }
            if sampler not in samplers:
                samplers.append(sampler)
            textures.append(
                {"source": images.index(self._image(texture)), "sampler": samplers.index(sampler)}
            )
        root: dict[str, Any] = {"materials": [_material(batch, used) for batch in batches]}
        if used:
            root |= {
                "images": [{"uri": name} for name in images],
                "samplers": samplers,
                "textures": textures,
            }
        required = ["KHR_mesh_quantization", PACKED]
        unlit = ["KHR_materials_unlit"] if any(batch.unlit for batch in batches) else []
        return root | {"extensionsUsed": required + unlit, "extensionsRequired": required}


def pack_uvs(uvs: NDArray[np.float32]) -> tuple[NDArray[Any], bool]:
    """Texture coordinates as uint16 fractions where all lie in [0, 1], else as they are."""
    if len(uvs) and uvs.min() >= 0 and uvs.max() <= 1:
        return np.rint(uvs.astype(np.float64) * 65535).astype(np.uint16), True
    return uvs, False


def _is_textured(batch: Batch) -> bool:
    return batch.texture is not None or batch.emissive_texture is not None


def _material(batch: Batch, used: list[int]) -> dict[str, Any]:
    surface: dict[str, Any] = {"metallicFactor": 0}
    if batch.texture is not None:
        surface["baseColorTexture"] = {"index": used.index(batch.texture)}
    material: dict[str, Any] = {"pbrMetallicRoughness": surface}
    if any(batch.emissive):
        material["emissiveFactor"] = [min(x, 1.0) for x in batch.emissive]
    if batch.emissive_texture is not None:
        material["emissiveTexture"] = {"index": used.index(batch.emissive_texture)}
    if batch.alpha == "mask":
        material |= {"alphaMode": "MASK", "alphaCutoff": batch.cutoff}
    elif batch.alpha == "dither":
        material |= {"alphaMode": "BLEND", "extras": {"alpha": "dither"}}
    if batch.double_sided:
        material["doubleSided"] = True
    if batch.unlit:
        material["extensions"] = {"KHR_materials_unlit": {}}
    return material
