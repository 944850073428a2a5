"""Near polygons of a cell: what its near blocks list, merged by material, clipped per fragment."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import farfield_shading as shading
import moderngl
import numpy as np
from farfield_core.errors import BadInputError
from farfield_core.walk import NearBlock
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.gl import context as gl
from farfield_worker.gl import textures
from farfield_worker.gl.programs import Programs, set_uniforms
from farfield_worker.gl.scene_buffers import buffer
from farfield_worker.shoot.canvas import CAMERA, OUTPUTS
from farfield_worker.shoot.glb import Material, NearTexture, Primitive, read_near_block

_VERTEX = (
    CAMERA
    + """
uniform vec3 eye;
out vec3 v_local;

vec4 clip_position(vec3 position) {
  v_local = position;
  return clip_point(position - eye, 1.0);
}
"""
)

_FRAGMENT = (
    OUTPUTS
    + """
uniform float near_field;
in vec3 v_local;

void main() {
  color = vec4(surface(pixel()), 1.0);
  far = 0.0;
  vec3 offset = abs(v_local);
  if (max(offset.x, max(offset.y, offset.z)) > near_field) discard;
}
"""
)

Arrays = dict[str, NDArray[Any]]


def merge_near(
    blocks: list[tuple[list[Primitive], tuple[int, ...]]], centre: NDArray[np.float64]
) -> dict[Material, Arrays]:
    """Vertices and triangles of each material, positions relative to `centre`.

    `blocks` holds near blocks with the (primitive, first triangle, triangles) triples that a cell
    lists of them. Raises BadInputError where a block does not have them.
    """
    pieces: dict[Material, list[Arrays]] = {}
    for primitives, ranges in blocks:
        for number, first, count in np.reshape(np.array(ranges, np.int64), (-1, 3)).tolist():
            if not 0 <= number < len(primitives) or not (
                0 <= first <= first + count <= len(primitives[number].triangles)
            ):
                raise BadInputError("A cell lists triangles that its near block does not have.")
            p = primitives[number]
            used, corners = np.unique(p.triangles[first : first + count], return_inverse=True)
            pieces.setdefault(p.material, []).append(
                {
                    "position": (p.positions[used] - centre).astype(np.float32),
                    "normal": p.normals[used],
                    "uv": p.uvs[used],
                    "color": p.colors[used],
                    "triangles": corners.reshape(-1, 3).astype(np.uint32),
                }
            )
    merged = {}
    for material, parts in pieces.items():
        starts = np.cumsum([0] + [len(part["position"]) for part in parts[:-1]])
        for part, start in zip(parts, starts, strict=True):
            part["triangles"] = part["triangles"] + np.uint32(start)
        merged[material] = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    return merged


class NearPolygons:
    """The near polygons of one cell on the GPU."""

    def __init__(
        self,
        context: moderngl.Context,
        blocks: tuple[NearBlock, ...],
        read: Callable[[str], bytes],
        centre: NDArray[np.float64],
        light: shading.Light,
    ) -> None:
        self._context = context
        self._programs = Programs(context, _VERTEX, _FRAGMENT, light)
        self._textures: dict[NearTexture, moderngl.Texture] = {}
        self._draws: list[tuple[Material, moderngl.VertexArray]] = []
        self._held: list[gl.Releasable] = []
        loaded = [(read_near_block(read(block.blob)), block.ranges) for block in blocks]
        for material, arrays in merge_near(loaded, centre).items():
            buffers = {name: buffer(context, array) for name, array in arrays.items()}
            indices = buffers.pop("triangles")
            array = self._programs.vertex_array(material.features, buffers, indices)
            self._held += [array, indices, *buffers.values()]
            self._draws.append((material, array))
            for texture in (material.texture, material.emissive_texture):
                if texture is not None and texture not in self._textures:
                    self._textures[texture] = _upload(context, texture, read)

    def draw(self, camera: dict[str, Any], eye: NDArray[np.float64], half_width: float) -> None:
        """Draw what lies within `half_width` of the centre; `eye` is relative to the centre."""
        self._programs.set(eye=tuple(eye), near_field=half_width, **camera)
        for material, array in self._draws:
            set_uniforms(
                self._programs.get(material.features),
                emissive_factor=material.emissive,
                cutoff=material.cutoff,
            )
            if material.texture is not None:
                self._textures[material.texture].use(0)
            if material.emissive_texture is not None:
                self._textures[material.emissive_texture].use(1)
            gl.cull_back_faces(self._context, not material.double_sided)
            array.render()

    def release(self) -> None:
        """Free what the GPU holds."""
        gl.release(*self._held, *self._textures.values())
        self._programs.release()


def _upload(
    context: moderngl.Context, texture: NearTexture, read: Callable[[str], bytes]
) -> moderngl.Texture:
    with Image.open(io.BytesIO(read(texture.file))) as image:
        return textures.upload(context, image, texture.wrap_u, texture.wrap_v, texture.filter)
