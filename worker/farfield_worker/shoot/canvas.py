"""The framebuffer pictures are drawn into, their camera and their sky."""

from __future__ import annotations

from typing import Any

import farfield_shading as shading
import moderngl
import numpy as np

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.shoot.view import Picture, View

#: Camera of all programs: `clip_point` takes a point relative to the eye times any w >= 0, and w;
#: at w = 0, infinitely far, the depth stays just above that of the background.
CAMERA = """
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform float focal;
uniform float near;
uniform vec2 jitter;

vec4 clip_point(vec3 q, float w) {
  float z = dot(q, forward);
  vec2 p = vec2(dot(q, right), dot(q, up));
  return vec4(focal * p + jitter * z, near * w + 1e-9 * z, z);
}
"""

#: What fragments write: the colour, and whether it is far field.
OUTPUTS = """
layout(location = 0) out vec4 color;
layout(location = 1) out float far;
uniform float top;

// Pixels are counted from the top left, as in the bake.
vec2 pixel() { return vec2(gl_FragCoord.x, top - gl_FragCoord.y); }
"""

_SKY_VERTEX = """
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform float focal;
uniform vec2 jitter;
out vec3 direction;

void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  vec2 at = (corner - jitter) / focal;
  direction = at.x * right + at.y * up + forward;
  gl_Position = vec4(corner, 0.0, 1.0);
}
"""

_SKY_FRAGMENT = """
in vec3 direction;
void main() {
  color = vec4(ff_to_srgb(ff_sky(direction)), 0.0);
  far = 0.0;
}
"""


class Canvas:
    """Draws pictures of one light model."""

    def __init__(self, context: moderngl.Context, light: shading.Light | None = None) -> None:
        self._context = context
        self._sky = context.program(
            vertex_shader=f"#version 450 core\n{_SKY_VERTEX}",
            fragment_shader=f"#version 450 core\n{shading.glsl()}{OUTPUTS}{_SKY_FRAGMENT}",
        )
        set_uniforms(self._sky, **shading.uniforms(light or shading.default_light()))
        self._sky_array = context.vertex_array(self._sky, [])
        self._framebuffer: moderngl.Framebuffer | None = None

    def begin(self, view: View) -> None:
        """Bind a framebuffer that shows the sky."""
        size = (view.size, view.size)
        if self._framebuffer is None or self._framebuffer.size != size:
            self._release_framebuffer()
            attachments = [self._context.texture(size, 4), self._context.texture(size, 1)]
            self._framebuffer = self._context.framebuffer(
                attachments, gl.float_depth(self._context, size)
            )
        self._framebuffer.use()
        self._framebuffer.clear(depth=0.0)
        self._context.enable_only(0)
        set_uniforms(self._sky, **camera(view, 0.0))
        self._sky_array.render(moderngl.TRIANGLES, vertices=3)
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.front_face = "ccw"

    def end(self) -> Picture:
        """Read the picture back."""
        assert self._framebuffer is not None
        height, width = self._framebuffer.height, self._framebuffer.width
        colors = self._framebuffer.read(components=4, alignment=1)
        far = self._framebuffer.read(components=1, attachment=1, alignment=1)
        rgba = np.frombuffer(colors, np.uint8).reshape(height, width, 4)[::-1].copy()
        ids = np.frombuffer(far, np.uint8).reshape(height, width)[::-1]
        return Picture(rgba, ids > 127)

    def release(self) -> None:
        """Free what the GPU holds."""
        self._release_framebuffer()
        gl.release(self._sky_array, self._sky)

    def _release_framebuffer(self) -> None:
        if self._framebuffer is not None:
            gl.release_framebuffer(self._framebuffer)
            self._framebuffer = None


def camera(view: View, near: float) -> dict[str, Any]:
    """Uniforms of `CAMERA` and `OUTPUTS`; `near` is used where the view names no near clip."""
    right, up, forward = view.axes()
    return {
        "right": tuple(right),
        "up": tuple(up),
        "forward": tuple(forward),
        "focal": view.focal,
        "near": near if view.near is None else view.near,
        # the scene moves against the samples: left and up
        "jitter": (-2 * view.jitter[0] / view.size, 2 * view.jitter[1] / view.size),
        "top": float(view.size),
    }
