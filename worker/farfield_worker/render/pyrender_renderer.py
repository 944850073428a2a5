"""The paper's plain way through pyrender: for every layer one draw of everything, clipped at the
layer's borders by the camera's near and far planes.

pyrender draws, but looks are ours: its shader programs are replaced by those of `gl.material`, and
its textures by sRGB ones. It is the baseline that the other renderers' speed is quoted against.
Texels differ from theirs where a border cuts a surface (a clipped edge is snapped to the pixel
grid, a discarded fragment is not), and where depths are closer than 24 bits tell apart.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import farfield_shading as shading
import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import Batch, PreparedScene
from farfield_core.scene import Texture as SceneTexture
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.gl import context as gl
from farfield_worker.gl.material import Features, surface_glsl
from farfield_worker.render.interface import FaceTexels
from farfield_worker.render.texels import LayerTexels, merge

# PyOpenGL decides once, on import, how it finds GL functions.
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

from OpenGL import GL
from pyrender import Mesh, MetallicRoughnessMaterial, PerspectiveCamera, Primitive, RenderFlags
from pyrender import Scene as PyrenderScene
from pyrender import Texture as PyrenderTexture
from pyrender.renderer import Renderer as PyrenderRendererBase
from pyrender.shader_program import ShaderProgram

#: pyrender keeps indices as 32-bit floats, which count no further exactly.
MOST_VERTICES = 1 << 24

_VERTEX = """#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 color;
layout(location = 4) in mat4 instance;
uniform mat4 M;
uniform mat4 V;
uniform mat4 P;
out vec2 v_uv;
out vec3 v_normal;
out vec4 v_color;

void main() {
  v_uv = uv;
  v_normal = normal;
  v_color = color;
  gl_Position = P * V * M * instance * vec4(position, 1.0);
}
"""

_FRAGMENT = """
uniform float top;
out vec4 texel;

void main() {
  texel = vec4(surface(vec2(gl_FragCoord.x, top - gl_FragCoord.y)), 1.0);
}
"""

#: pyrender's uniforms -> those of `gl.material`; names that a program lacks are ignored
_UNIFORMS = {
    "material.base_color_texture": "base_texture",
    "material.emissive_texture": "emissive_texture",
}


class _Program(ShaderProgram):  # type: ignore[misc]
    """A program from text instead of from files."""

    def _load(self, shader_filename: str) -> str:
        return shader_filename

    def set_uniform(self, name: str, value: Any, unsigned: bool = False) -> None:
        super().set_uniform(_UNIFORMS.get(name, name), value, unsigned)


class _Texture(PyrenderTexture):  # type: ignore[misc]
    """An sRGB texture, row 0 first, as glTF's texture coordinates count."""

    def __init__(self, image: Image.Image, entry: SceneTexture) -> None:
        super().__init__(source=np.asarray(image.convert("RGBA")), source_channels="RGBA")
        self._entry = entry

    def _add_to_context(self) -> None:
        nearest = self._entry.filter == "nearest"
        wraps = {
            "repeat": GL.GL_REPEAT,
            "clamp": GL.GL_CLAMP_TO_EDGE,
            "mirror": GL.GL_MIRRORED_REPEAT,
        }
        self._texid = GL.glGenTextures(1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._texid)
        height, width = self.source.shape[:2]
        GL.glTexImage2D(
            GL.GL_TEXTURE_2D,
            0,
            GL.GL_SRGB8_ALPHA8,
            width,
            height,
            0,
            GL.GL_RGBA,
            GL.GL_UNSIGNED_BYTE,
            np.ascontiguousarray(self.source),
        )
        GL.glGenerateMipmap(GL.GL_TEXTURE_2D)
        for name, value in (
            (GL.GL_TEXTURE_MAG_FILTER, GL.GL_NEAREST if nearest else GL.GL_LINEAR),
            (
                GL.GL_TEXTURE_MIN_FILTER,
                GL.GL_NEAREST_MIPMAP_LINEAR if nearest else GL.GL_LINEAR_MIPMAP_LINEAR,
            ),
            (GL.GL_TEXTURE_WRAP_S, wraps[self._entry.wrap_u]),
            (GL.GL_TEXTURE_WRAP_T, wraps[self._entry.wrap_v]),
        ):
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
        GL.glBindTexture(GL.GL_TEXTURE_2D, 0)


class _Drawer(PyrenderRendererBase):  # type: ignore[misc]
    """pyrender's renderer with Farfield's light model and one sample per texel."""

    def __init__(self, size: int, batches: dict[int, Batch]) -> None:
        super().__init__(size, size)
        #: batch of each primitive, by the primitive's id()
        self._batches = batches
        self._programs: dict[Features, _Program] = {}

    def _get_primitive_program(
        self, primitive: Primitive, flags: int, program_flags: int
    ) -> _Program:
        features = Features.of(self._batches[id(primitive)])
        if features not in self._programs:
            fragment = "#version 330 core\n" + surface_glsl(features) + _FRAGMENT
            self._programs[features] = _Program(_VERTEX, fragment)
            self._programs[features]._add_to_context()
        return self._programs[features]

    def _bind_and_draw_primitive(
        self, primitive: Primitive, pose: Any, program: _Program, flags: int
    ) -> None:
        batch = self._batches[id(primitive)]
        light = shading.uniforms(shading.default_light())
        for name, value in {**light, "emissive_factor": batch.emissive}.items():
            program.set_uniform(name, np.asarray(value, np.float32))
        program.set_uniform("cutoff", float(batch.cutoff))
        program.set_uniform("top", float(self.viewport_height))
        super()._bind_and_draw_primitive(primitive, pose, program, flags)

    def _configure_main_framebuffer(self) -> None:
        size = (self.viewport_width, self.viewport_height)
        fresh = self._main_fb_dims != size
        super()._configure_main_framebuffer()
        if fresh:
            # Four samples would blend texels with what lies behind them.
            for buffer, kind in (
                (self._main_cb_ms, GL.GL_RGBA8),
                (self._main_db_ms, GL.GL_DEPTH_COMPONENT24),
            ):
                GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
                GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, kind, *size)
            # Mesa asks again whether a framebuffer is complete only when another one was bound.
            GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._main_fb)

    def __del__(self) -> None:
        """Do nothing: there may be no context any more; `close` frees everything."""

    def delete(self) -> None:
        for program in self._programs.values():
            program.delete()
        self._programs = {}
        super().delete()


class PyrenderRenderer:
    """Draws every triangle for every layer through pyrender, in a GL context of its own."""

    def __init__(self, scene: PreparedScene) -> None:
        options: dict[str, Any] = {"standalone": True, "backend": "egl", "require": 410}
        self._context = moderngl.create_context(**options)
        self._origin = scene.origin
        with self._context:
            self.name = f"pyrender on {gl.device_name(self._context)}"
            self._batches: dict[int, Batch] = {}
            self._scene = PyrenderScene(bg_color=(0.0, 0.0, 0.0, 0.0))
            primitives = self._primitives(scene)
            if primitives:
                self._scene.add(Mesh(primitives))
            self._camera = PerspectiveCamera(yfov=np.pi / 2, aspectRatio=1.0)
            self._camera_node = self._scene.add(self._camera)
            self._drawer: _Drawer | None = None

    def _primitives(self, scene: PreparedScene) -> list[Primitive]:
        """One primitive per batch, or a few where a batch has too many vertices for one."""
        textures = []
        for entry in scene.info.textures:
            with Image.open(scene.folder / "textures" / entry.file) as image:
                textures.append(_Texture(image, entry))
        primitives = []
        for number, batch in enumerate(scene.info.batches):
            material = MetallicRoughnessMaterial(
                doubleSided=batch.double_sided,
                baseColorTexture=None if batch.texture is None else textures[batch.texture],
                emissiveTexture=None
                if batch.emissive_texture is None
                else textures[batch.emissive_texture],
            )
            rows = _triangles_of(scene, number)
            for first in range(0, len(rows), MOST_VERTICES // 3):
                triangles = scene.triangles[rows[first : first + MOST_VERTICES // 3]]
                used, corners = np.unique(triangles, return_inverse=True)
                primitive = Primitive(
                    positions=scene.positions[used],
                    normals=scene.normals[used, :3] / np.float32(127),
                    texcoord_0=scene.uvs[used],
                    color_0=scene.colors[used] / np.float32(65535),
                    indices=corners.reshape(-1, 3),
                    material=material,
                )
                self._batches[id(primitive)] = batch
                primitives.append(primitive)
        return primitives

    def face(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], resolution: int
    ) -> FaceTexels:
        """See `Renderer.face`."""
        _, right, down, forward = FACES[face]
        pose = np.eye(4)
        pose[:3, :3] = np.stack([right, -down, -forward], axis=1)
        pose[:3, 3] = np.asarray(eye, np.float64) - self._origin
        limits = [None, *borders]
        layers = []
        with self._context:
            drawer = self._open_drawer(resolution)
            self._scene.set_pose(self._camera_node, pose)
            for layer, (far, near) in enumerate(zip(limits[:-1], borders, strict=True)):
                # the far plane may not be set below the near plane, not even for a moment
                self._camera.zfar = None
                self._camera.znear = near
                self._camera.zfar = far
                color, depth = drawer.render(
                    self._scene, RenderFlags.OFFSCREEN | RenderFlags.RGBA | RenderFlags.FLAT
                )
                texel = np.flatnonzero(color[..., 3]).astype(np.int32)
                packed = np.ascontiguousarray(color).view(np.uint32).ravel()
                distance = depth.ravel()[texel]
                # pyrender says 0 where the depth buffer holds its greatest value
                distance[distance == 0.0] = near * 2.0**24 if far is None else far
                layers.append((layer, LayerTexels(texel, packed[texel], distance)))
        return merge(layers, resolution)

    def _open_drawer(self, resolution: int) -> _Drawer:
        if self._drawer is None:
            self._drawer = _Drawer(resolution, self._batches)
        self._drawer.viewport_width = self._drawer.viewport_height = resolution
        return self._drawer

    def close(self) -> None:
        """Free what the GPU holds."""
        with self._context:
            if self._drawer is not None:
                self._drawer.delete()
                self._drawer = None
        self._context.release()


def _triangles_of(scene: PreparedScene, batch: int) -> NDArray[np.int64]:
    """Triangles of one batch, (n,) int64, in the scene's order."""
    runs = [
        np.arange(part.first_triangle, part.first_triangle + part.triangles)
        for block in scene.info.blocks
        for part in block.parts
        if part.batch == batch
    ]
    return np.concatenate(runs) if runs else np.empty(0, np.int64)
