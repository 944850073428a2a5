"""One program per kind of material, with a camera and outputs of the caller's choice."""

from __future__ import annotations

from typing import Any

import farfield_shading as shading
import moderngl

from farfield_worker.gl import context as gl
from farfield_worker.gl.material import Features, surface_glsl

#: moderngl's formats of vertex buffers; integers arrive as floats, not normalised
FORMATS = {"position": "3f", "uv": "2f", "normal": "4i1", "color": "4u2"}

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


class Programs:
    """Compiles and keeps the programs of materials.

    `vertex_glsl` defines `vec4 clip_position(vec3 position)`; `fragment_glsl` is a `main` that
    calls `surface` (see `material`). Vertices are buffers named and formatted as in `FORMATS`.
    """

    def __init__(
        self,
        context: moderngl.Context,
        vertex_glsl: str,
        fragment_glsl: str,
        light: shading.Light | None = None,
    ) -> None:
        self._context = context
        self._vertex_glsl = vertex_glsl
        self._fragment_glsl = fragment_glsl
        self._light = shading.uniforms(light or shading.default_light())
        self._programs: dict[Features, moderngl.Program] = {}

    def get(self, features: Features) -> moderngl.Program:
        """Return the program of materials with `features`."""
        if features not in self._programs:
            program = self._context.program(
                vertex_shader=f"#version 450 core\n{_VERTEX}{self._vertex_glsl}{_VERTEX_MAIN}",
                fragment_shader="#version 450 core\n"
                + surface_glsl(features)
                + self._fragment_glsl,
            )
            set_uniforms(program, **self._light, base_texture=0, emissive_texture=1)
            self._programs[features] = program
        return self._programs[features]

    def vertex_array(
        self, features: Features, buffers: dict[str, moderngl.Buffer], indices: moderngl.Buffer
    ) -> moderngl.VertexArray:
        """Vertices for `features`: `buffers` by the names of `FORMATS`, uint32 `indices`."""
        program = self.get(features)
        members = set(program)
        content = [
            (buffer, FORMATS[name], f"in_{name}")
            for name, buffer in buffers.items()
            if f"in_{name}" in members  # a compiler drops what a material does not read
        ]
        return self._context.vertex_array(program, content, indices, index_element_size=4)

    def set(self, **values: Any) -> None:
        """Set uniforms in all programs compiled so far."""
        for program in self._programs.values():
            set_uniforms(program, **values)

    def release(self) -> None:
        """Free all programs."""
        gl.release(*self._programs.values())
        self._programs.clear()


def set_uniforms(program: moderngl.Program, **values: Any) -> None:
    """Set those of `values` that the program uses; a compiler drops the others."""
    for name, value in values.items():
        uniform = program.get(name, None)
        if isinstance(uniform, moderngl.Uniform):
            uniform.value = value
