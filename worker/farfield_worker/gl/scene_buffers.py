"""A prepared scene on the GPU: vertex buffers, textures, and one program per kind of material."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import farfield_shading as shading
import moderngl
import numpy as np
from farfield_core.scene import Batch, PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl import textures
from farfield_worker.gl.material import Features, surface_glsl

#: moderngl's formats of the prepared arrays; integers arrive as floats, not normalised
_FORMATS = {"position": "3f", "uv": "2f", "normal": "4i1", "color": "4u2"}

_VERTEX = """
in vec3 in_position;
in vec2 in_uv;
in vec4 in_normal;
in vec4 in_color;
out vec2 v_uv;
out vec3 v_normal;
out vec4 v_color;
invariant gl_Position;
"""

_VERTEX_MAIN = """
void main() {
  v_uv = in_uv;
  v_normal = in_normal.xyz / 127.0;
  v_color = in_color / 65535.0;
  gl_Position = clip_position(in_position);
}
"""


class SceneBuffers:
    """Vertices and textures of a prepared scene, uploaded once, and programs to draw them with.

    `vertex_glsl` defines `vec4 clip_position(vec3 position)`, `position` being relative to the
    scene's origin; `fragment_glsl` is a `main` that calls `surface` (see `material`).
    """

    def __init__(
        self,
        context: moderngl.Context,
        scene: PreparedScene,
        vertex_glsl: str,
        fragment_glsl: str,
    ) -> None:
        self.context = context
        self.batches = scene.info.batches
        self._vertex_glsl = vertex_glsl
        self._fragment_glsl = fragment_glsl
        arrays: dict[str, NDArray[Any]] = {
            "position": scene.positions,
            "uv": scene.uvs,
            "normal": scene.normals,
            "color": scene.colors,
        }
        self._buffers = {
            # moderngl refuses empty buffers
            name: context.buffer(np.ascontiguousarray(a)) if len(a) else context.buffer(reserve=16)
            for name, a in arrays.items()
        }
        self._textures = [
            textures.upload_file(
                context, scene.folder / "textures" / t.file, t.wrap_u, t.wrap_v, t.filter
            )
            for t in scene.info.textures
        ]
        self.programs: dict[Features, moderngl.Program] = {}
        for batch in self.batches:
            features = Features.of(batch)
            if features not in self.programs:
                self.programs[features] = self._compile(features)

    def _compile(self, features: Features) -> moderngl.Program:
        program = self.context.program(
            vertex_shader=f"#version 450 core\n{_VERTEX}{self._vertex_glsl}{_VERTEX_MAIN}",
            fragment_shader="#version 450 core\n" + surface_glsl(features) + self._fragment_glsl,
        )
        set_uniforms(program, **shading.uniforms(shading.default_light()))
        set_uniforms(program, base_texture=0, emissive_texture=1)
        return program

    def vertex_arrays(self, indices: moderngl.Buffer) -> list[moderngl.VertexArray]:
        """One vertex array per batch, drawing from `indices` (uint32)."""
        arrays: dict[Features, moderngl.VertexArray] = {}
        for features, program in self.programs.items():
            content = [
                (buffer, _FORMATS[name], f"in_{name}")
                for name, buffer in self._buffers.items()
                if f"in_{name}" in program
            ]
            arrays[features] = self.context.vertex_array(
                program, content, indices, index_element_size=4
            )
        return [arrays[Features.of(batch)] for batch in self.batches]

    def set(self, **values: Any) -> None:
        """Set uniforms in all programs."""
        for program in self.programs.values():
            set_uniforms(program, **values)

    def bind(self, batch: Batch) -> None:
        """Set a batch's textures, uniforms and culling."""
        program = self.programs[Features.of(batch)]
        set_uniforms(program, emissive_factor=batch.emissive, cutoff=batch.cutoff)
        if batch.texture is not None:
            self._textures[batch.texture].use(0)
        if batch.emissive_texture is not None:
            self._textures[batch.emissive_texture].use(1)
        toggle: Callable[[int], None] = (
            self.context.disable if batch.double_sided else self.context.enable
        )
        toggle(moderngl.CULL_FACE)

    def release(self) -> None:
        """Free what the GPU holds."""
        gl.release(*self._buffers.values(), *self._textures, *self.programs.values())


def set_uniforms(program: moderngl.Program, **values: Any) -> None:
    """Set those of `values` that the program uses; a compiler drops the others."""
    for name, value in values.items():
        uniform = program.get(name, None)
        if isinstance(uniform, moderngl.Uniform):
            uniform.value = value
