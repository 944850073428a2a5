"""One cell of a walk as a GLB that any glTF viewer shows as Farfield does, from eyes in the cell.

Far quads become textured triangles (gltf/flatten.py), near polygons painted ones
(gltf/polygons.py). All materials are unlit (KHR_materials_unlit), the origin is the cell's centre,
images are embedded.
"""

from __future__ import annotations

import io
from typing import Any

import farfield_shading as shading
import numpy as np
from farfield_core.walk import CellFile, Walk
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.gltf.flatten import Flat, flatten
from farfield_worker.gltf.polygons import clipped, painted
from farfield_worker.near.glb import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbWriter
from farfield_worker.shoot.glb import Material, NearTexture, read_near_block
from farfield_worker.shoot.near import merge_near
from farfield_worker.shoot.walk_files import WalkFiles
from farfield_worker.slanted.clip import texel_line

Json = dict[str, Any]

_NEAREST, _LINEAR, _MIPMAPS = 9728, 9729, 9987
_WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
_UNLIT = "KHR_materials_unlit"


def cell_glb(files: WalkFiles, cell: CellFile) -> bytes:
    """The GLB of a `cell` that `files` has."""
    model = _Model(files, cell)
    model.add_far()
    model.add_near()
    return model.finish()


class _Model:
    """What has been written of a model so far."""

    def __init__(self, files: WalkFiles, cell: CellFile) -> None:
        self._files, self._cell = files, cell
        self._walk: Walk = files.walk
        self._centre = np.array(cell.eyes[0], np.float64)
        self._writer = GlbWriter()
        self._primitives: dict[str, list[Json]] = {"far": [], "near": []}
        self._materials: list[Json] = []
        self._textures: list[Json] = []
        self._samplers: list[Json] = []
        self._images: list[Json] = []

    def add_far(self) -> None:
        """Add the quads, the nearest last: most viewers draw what comes later over its equals."""
        quads, walk = self._cell.quads, self._walk
        size = np.array([walk.atlas.width, walk.atlas.height], np.float64)
        starts = np.concatenate([[0], np.cumsum(quads.corner_counts)])
        corners = np.array(quads.corners, np.float64).reshape(-1, 2)
        planes = np.array(quads.planes, np.float64).reshape(-1, 3)
        offsets = np.array(quads.offsets, np.float64).reshape(-1, 2)
        least = 1.0 / (walk.resolution * max(walk.grid.size))
        for page, name in enumerate(self._cell.atlases):
            parts: list[tuple[Flat, NDArray[np.float64]]] = []
            for q in reversed(range(len(quads.faces))):
                if quads.pages[q] != page:
                    continue
                flat = flatten(
                    quads.faces[q],
                    np.array(self._cell.eyes[quads.eyes[q]]) - self._centre,
                    corners[starts[q] : starts[q + 1]],
                    texel_line(planes[q], walk.resolution),
                    walk.resolution,
                    least,
                )
                along = flat.texels[:, ::-1] if quads.turned[q] else flat.texels
                parts.append((flat, (quads.scales[q] * along + offsets[q]) / size))
            if not parts:
                continue
            texture = self._texture(self._png(name), _NEAREST, _NEAREST, "clamp", "clamp")
            ends = np.cumsum([len(flat.points) for flat, _ in parts])
            triangles = [
                flat.triangles + end - len(flat.points)
                for (flat, _), end in zip(parts, ends, strict=True)
            ]
            self._add(
                "far",
                np.concatenate([flat.points for flat, _ in parts]),
                np.concatenate(triangles),
                {"alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True},
                texture,
                {"TEXCOORD_0": np.concatenate([uv for _, uv in parts])},
            )

    def add_near(self) -> None:
        """Add the near polygons."""
        blocks = [
            (read_near_block(self._files.near(block.blob)), block.ranges)
            for block in self._cell.near
        ]
        light: shading.Light = {name: list(v) for name, v in self._walk.light.items()}
        for material, mesh in merge_near(blocks, self._centre).items():
            arrays = clipped(mesh, self._walk.near_drawn)
            if not len(arrays["triangles"]):
                continue
            attributes: Json = {"COLOR_0": painted(arrays, material, light)}
            texture = None
            if material.texture is not None:
                attributes["TEXCOORD_0"] = arrays["uv"]
                texture = self._near_texture(material.texture)
            self._add(
                "near",
                arrays["position"],
                arrays["triangles"],
                _alpha(material) | {"doubleSided": material.double_sided},
                texture,
                attributes,
            )

    def finish(self) -> bytes:
        """The file."""
        shown = [name for name, found in self._primitives.items() if found]
        root: Json = {
            "scene": 0,
            "scenes": [{"nodes": list(range(len(shown)))}],
            "nodes": [{"name": name, "mesh": n} for n, name in enumerate(shown)],
            "meshes": [{"name": name, "primitives": self._primitives[name]} for name in shown],
            "materials": self._materials,
            "textures": self._textures,
            "samplers": self._samplers,
            "images": self._images,
        }
        used = {key: value for key, value in root.items() if value != []}
        if not shown:
            used["scenes"] = [{}]
        return self._writer.finish(used | {"extensionsUsed": [_UNLIT]})

    def _add(
        self,
        kind: str,
        points: NDArray[np.float64],
        triangles: NDArray[np.int64],
        material: Json,
        texture: int | None,
        attributes: dict[str, NDArray[Any]],
    ) -> None:
        self._materials.append(material | {"extensions": {_UNLIT: {}}})
        pbr: Json = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
        if texture is not None:
            pbr["baseColorTexture"] = {"index": texture}
        self._materials[-1]["pbrMetallicRoughness"] = pbr
        written = {
            name: self._writer.add(values.astype(np.float32), ARRAY_BUFFER)
            for name, values in attributes.items()
        }
        written["POSITION"] = self._writer.add(points.astype(np.float32), ARRAY_BUFFER, bounds=True)
        indices = self._writer.add(triangles.astype(np.uint32).reshape(-1, 1), ELEMENT_ARRAY_BUFFER)
        self._primitives[kind].append(
            {"attributes": written, "indices": indices, "material": len(self._materials) - 1}
        )

    def _near_texture(self, texture: NearTexture) -> int:
        smooth = texture.filter == "linear"
        return self._texture(
            self._files.near(texture.file),
            _LINEAR if smooth else _NEAREST,
            _MIPMAPS if smooth else _NEAREST,
            texture.wrap_u,
            texture.wrap_v,
        )

    def _texture(self, data: bytes, magnify: int, minify: int, wrap_u: str, wrap_v: str) -> int:
        kind = "image/jpeg" if data[:2] == b"\xff\xd8" else "image/png"
        self._images.append({"bufferView": self._writer.add_blob(data), "mimeType": kind})
        self._samplers.append(
            {
                "magFilter": magnify,
                "minFilter": minify,
                "wrapS": _WRAPS[wrap_u],
                "wrapT": _WRAPS[wrap_v],
            }
        )
        self._textures.append({"source": len(self._images) - 1, "sampler": len(self._samplers) - 1})
        return len(self._textures) - 1

    def _png(self, name: str) -> bytes:
        """An atlas page as PNG: glTF itself knows no WebP."""
        data = self._files.atlas(name)
        if data[:4] == b"\x89PNG":
            return data
        out = io.BytesIO()
        with Image.open(io.BytesIO(data)) as image:
            image.save(out, "PNG")
        return out.getvalue()


def _alpha(material: Material) -> Json:
    """How opacity is shown; what Farfield screens, others blend."""
    if material.alpha == "mask":
        return {"alphaMode": "MASK", "alphaCutoff": material.cutoff}
    return {"alphaMode": "BLEND" if material.alpha == "dither" else "OPAQUE"}
