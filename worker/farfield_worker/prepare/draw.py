"""A plain painter of prepared scenes: chunk by chunk, so that memory stays small."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import moderngl
import numpy as np
from farfield_core.scene import Batch, PreparedScene
from farfield_shading import default_light, glsl, uniforms
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.prepare.camera import Camera

#: blocks on the GPU at a time
_CHUNK = 128
_LARGEST_TEXTURE = 1024
_SRGB8_ALPHA8 = 0x8C43

_VERTEX = """
#version 330
uniform mat4 matrix;
in vec3 position;
in ivec4 normal;
in vec2 uv;
in uvec4 color;
out vec3 v_normal;
out vec2 v_uv;
out vec4 v_color;
void main() {
  v_normal = vec3(normal.xyz);
  v_uv = uv;
  v_color = vec4(color) / 65535.0;
  gl_Position = matrix * vec4(position, 1.0);
}
"""

_FRAGMENT = """
#version 330
%s
uniform sampler2D base_texture;
uniform sampler2D emissive_texture;
uniform vec3 emissive;
uniform float cutoff; // below 0: opaque; above 1: dithered
uniform float unlit;
in vec3 v_normal;
in vec2 v_uv;
in vec4 v_color;
out vec4 pixel;
void main() {
  vec4 base = v_color * texture(base_texture, v_uv);
  if (cutoff > 1.0 ? !ff_dither(base.a, gl_FragCoord.xy) : base.a < cutoff) discard;
  vec3 n = normalize(gl_FrontFacing ? v_normal : -v_normal);
  vec3 glow = emissive * texture(emissive_texture, v_uv).rgb;
  pixel = vec4(ff_to_srgb(ff_shade(base.rgb, n, glow, unlit)), 1.0);
}
"""

_SKY_VERTEX = """
#version 330
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(at, 1.0, 1.0);
}
"""

_SKY_FRAGMENT = """
#version 330
%s
uniform mat3 rays;
in vec2 at;
out vec4 pixel;
void main() { pixel = vec4(ff_to_srgb(ff_sky(rays * vec3(at, 1.0))), 1.0); }
"""


class Painter:
    """Draws pictures of one scene. Holds a GL context: create it in the process that uses it."""

    def __init__(self, context: moderngl.Context, scene: PreparedScene) -> None:
        self._context = context
        self._scene = scene
        self._program = context.program(_VERTEX, _FRAGMENT % glsl())
        self._sky = context.program(_SKY_VERTEX, _SKY_FRAGMENT % glsl())
        for program in (self._program, self._sky):
            for name, value in uniforms(default_light()).items():
                if name in program:
                    program[name] = value
        self._program["emissive_texture"] = 1
        self._white = self._upload(np.full((1, 1, 4), 255, np.uint8))
        self._textures = [self._texture(index) for index in range(len(scene.info.textures))]

    @classmethod
    def create(cls, scene: PreparedScene) -> Painter | None:
        """Return a painter; None where the machine offers no OpenGL."""
        try:
            options: dict[str, Any] = {"standalone": True, "require": 330, "backend": "egl"}
            context = moderngl.create_context(**options)
        except Exception:  # glcontext raises bare Exception, and OSError for missing libraries
            return None
        context.gc_mode = "auto"
        return cls(context, scene)

    def close(self) -> None:
        """Free the context."""
        # What Python still holds dies with it; freed later, it would be freed in another context.
        context: Any = (
            self._context
        )  # moderngl types the mode that ends collecting as a string only
        context.gc_mode = None
        context.release()

    def draw(self, camera: Camera, width: int, height: int, sky: bool) -> NDArray[np.uint8]:
        """(height, width, 4) uint8, sRGB; without `sky` the background is transparent."""
        context = self._context
        target = context.framebuffer(
            [context.renderbuffer((width, height), 4)], context.depth_renderbuffer((width, height))
        )
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0)
        context.front_face = "ccw"
        if sky:
            context.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            self._sky["rays"] = tuple(camera.rays.T.ravel().tolist())
            context.vertex_array(self._sky, []).render(moderngl.TRIANGLES, vertices=3)
        context.enable(moderngl.DEPTH_TEST)
        self._program["matrix"] = tuple(camera.matrix.T.ravel().tolist())
        for first in range(0, len(self._scene.info.blocks), _CHUNK):
            self._draw_chunk(first, min(first + _CHUNK, len(self._scene.info.blocks)))
        pixels = np.frombuffer(target.read(components=4), np.uint8).reshape(height, width, 4)
        if context.error != "GL_NO_ERROR":
            raise RuntimeError("OpenGL reported an error while drawing the scene's pictures.")
        return pixels[::-1]

    def _draw_chunk(self, first: int, last: int) -> None:
        scene, context = self._scene, self._context
        blocks = scene.info.blocks[first:last]
        low = blocks[0].first_vertex
        rows = slice(low, blocks[-1].first_vertex + blocks[-1].vertices)
        buffers = [
            context.buffer(np.ascontiguousarray(array[rows]).tobytes())
            for array in (scene.positions, scene.normals, scene.uvs, scene.colors)
        ]
        layout = [
            (buffers[0], "3f", "position"),
            (buffers[1], "4i1", "normal"),
            (buffers[2], "2f", "uv"),
            (buffers[3], "4u2", "color"),
        ]
        parts: dict[int, list[NDArray[np.uint32]]] = defaultdict(list)
        for block in blocks:
            for part in block.parts:
                end = part.first_triangle + part.triangles
                parts[part.batch].append(scene.triangles[part.first_triangle : end])
        for batch, triangles in parts.items():
            indices = np.concatenate(triangles) - np.uint32(low)
            self._set(scene.info.batches[batch])
            context.vertex_array(self._program, layout, context.buffer(indices.tobytes())).render()

    def _set(self, batch: Batch) -> None:
        program = self._program
        program["cutoff"] = {"opaque": -1.0, "mask": batch.cutoff, "dither": 2.0}[batch.alpha]
        program["emissive"] = batch.emissive
        program["unlit"] = float(batch.unlit)
        for unit, texture in enumerate((batch.texture, batch.emissive_texture)):
            (self._white if texture is None else self._textures[texture]).use(unit)
        if batch.double_sided:
            self._context.disable(moderngl.CULL_FACE)
        else:
            self._context.enable(moderngl.CULL_FACE)

    def _texture(self, index: int) -> moderngl.Texture:
        entry = self._scene.info.textures[index]
        with Image.open(self._scene.folder / "textures" / entry.file) as image:
            image.thumbnail((_LARGEST_TEXTURE, _LARGEST_TEXTURE))
            texture = self._upload(np.asarray(image.convert("RGBA")))
        texture.repeat_x, texture.repeat_y = entry.wrap_u != "clamp", entry.wrap_v != "clamp"
        return texture

    def _upload(self, pixels: NDArray[np.uint8]) -> moderngl.Texture:
        height, width = pixels.shape[:2]
        texture = self._context.texture(
            (width, height), 4, pixels.tobytes(), internal_format=_SRGB8_ALPHA8
        )
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        return texture
