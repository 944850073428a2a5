"""Draw the quads made so far into a map of disparities, to see what they leave out.

Quads are drawn as readers draw them (docs/format.md): homogeneous corners, no gap between near and
infinity, seen from their eye's side of the plane only, opaque where their sheet has a
texel. Sheets need no atlas here: each quad's corner says where its sheet's texels start in one
storage buffer.
"""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np
from farfield_core.faces import FACES, directions
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.slanted.quads import SlantedQuads

Floats = NDArray[np.float64]

_NEAR = 0.02

_VERTEX = """#version 450 core
in vec4 in_point;
in vec2 in_texel;
in ivec3 in_sheet;
out vec2 v_texel;
flat out ivec3 v_sheet;
uniform vec3 eye;
uniform vec3 right;
uniform vec3 down;
uniform vec3 forward;
uniform float near;

void main() {
  vec3 q = in_point.xyz - eye * in_point.w;
  gl_Position = vec4(dot(q, right), dot(q, down), near * in_point.w, dot(q, forward));
  v_texel = in_texel;
  v_sheet = in_sheet;
}
"""

_FRAGMENT = """#version 450 core
in vec2 v_texel;
flat in ivec3 v_sheet;
layout(std430, binding = 0) readonly buffer Texels { uint texels[]; };
layout(location = 0) out float disparity;
layout(location = 1) out uint shown;
uniform float near;

void main() {
  // corners go round as seen from the quad's own eye, in rows that go down
  if (!gl_FrontFacing) discard;
  ivec2 texel = clamp(ivec2(floor(v_texel)), ivec2(0), v_sheet.yz - 1);
  uint color = texels[v_sheet.x + texel.y * v_sheet.y + texel.x];
  if (color == 0u) discard;
  disparity = gl_FragCoord.z / near;
  shown = color;
}
"""


class QuadVertices(NamedTuple):
    """Triangles of quads as the GPU gets them.

    Attributes:
        vertices: (n,) records: homogeneous point relative to the cell's centre, texel in the
            sheet, the sheet's first texel, width and height.
        texels: (m,) uint32, the sheets' texels, RGBA8 packed, 0 where there is nothing.
    """

    vertices: NDArray[np.void]
    texels: NDArray[np.uint32]


_RECORD = np.dtype([("point", "4f4"), ("texel", "2f4"), ("sheet", "3i4")])


def quad_vertices(face: int, eye: Floats, quads: SlantedQuads, resolution: int) -> QuadVertices:
    """Triangle fans of `quads` on `face` of `eye` (3,), relative to the cell's centre."""
    images = [image.view(np.uint32).reshape(-1) for image in quads.images]
    texels = np.concatenate(images) if images else np.zeros(0, np.uint32)
    starts = np.cumsum([0, *(len(image) for image in images)])
    counts = np.array([len(p) for p in quads.polygons], np.int64)
    corners = np.concatenate(quads.polygons) if len(counts) else np.zeros((0, 2))
    quad = np.repeat(np.arange(len(counts)), counts)
    u, v = (2.0 * corners / resolution - 1.0).T
    a, b, c = quads.plane[quad].T
    d = np.maximum(a * u + b * v + c, 0.0)
    record = np.zeros(len(corners), _RECORD)
    record["point"] = np.column_stack([directions(face, u, v) + d[:, None] * eye, d])
    sheet = quads.sheet[quad]
    rect = quads.texels.rect[sheet]
    record["texel"] = corners - rect[:, :2]
    record["sheet"] = np.column_stack([starts[sheet], rect[:, 2:] - rect[:, :2]])
    # a fan of corners 0, i, i + 1 for i = 1 .. count - 2
    first = np.cumsum(counts) - counts
    triangles = counts - 2
    fan = np.repeat(first, triangles)
    step = np.arange(len(fan)) - np.repeat(np.cumsum(triangles) - triangles, triangles) + 1
    index = np.column_stack([fan, fan + step, fan + step + 1]).reshape(-1)
    return QuadVertices(record[index], texels)


class QuadPainter:
    """Draws quads on faces of eyes; add quads of as many faces and eyes as there are."""

    def __init__(self, resolution: int) -> None:
        self.resolution = resolution
        self._parts: list[QuadVertices] = []
        self._texels = 0
        self._array: moderngl.VertexArray | None = None
        with gl.current() as context:
            self._program = context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
            self._disparity = context.texture((resolution, resolution), 1, dtype="f4")
            self._color = context.texture((resolution, resolution), 1, dtype="u4")
            self._depth = gl.float_depth(context, (resolution, resolution))
            self._framebuffer = context.framebuffer([self._disparity, self._color], self._depth)

    def clear(self) -> None:
        """Forget all quads."""
        self._parts.clear()
        self._texels = 0
        self._forget()

    def add(self, face: int, eye: Floats, quads: SlantedQuads) -> None:
        """Add quads of `face` of `eye` (3,), relative to the cell's centre."""
        part = quad_vertices(face, eye, quads, self.resolution)
        part.vertices["sheet"][:, 0] += self._texels
        self._texels += len(part.texels)
        self._parts.append(part)
        self._forget()

    def draw(self, face: int, eye: Floats) -> NDArray[np.float32]:
        """Disparity shown on `face` of `eye` (3,), relative to the cell's centre.

        (resolution, resolution), row 0 on top; 0 where there is nothing.
        """
        _, right, down, forward = FACES[face]
        with gl.current() as context:
            self._upload(context)
            self._framebuffer.use()
            context.enable_only(moderngl.DEPTH_TEST)
            context.front_face = "ccw"
            # this leaves integers undefined, so colours count only where there is a disparity
            self._framebuffer.clear(depth=0.0)
            axes = {"eye": eye, "right": right, "down": down, "forward": forward}
            set_uniforms(self._program, near=_NEAR, **{k: tuple(v) for k, v in axes.items()})
            if self._array is not None:
                self._texel_buffer.bind_to_storage_buffer(0)
                self._array.render(moderngl.TRIANGLES)
            data = np.frombuffer(self._disparity.read(), np.float32)
        return data.reshape(self.resolution, self.resolution)

    def picture(self, face: int, eye: Floats) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """As `draw`, with the colours, RGBA8 packed."""
        disparity = self.draw(face, eye)
        with gl.current():
            data = np.frombuffer(self._color.read(), np.uint32).reshape(disparity.shape)
        return disparity, np.where(disparity > 0, data, np.uint32(0))

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            self.clear()
            gl.release_framebuffer(self._framebuffer)
            self._program.release()

    def _upload(self, context: moderngl.Context) -> None:
        if self._array is not None or not any(len(p.vertices) for p in self._parts):
            return
        vertices = np.concatenate([p.vertices for p in self._parts])
        texels = np.concatenate([p.texels for p in self._parts])
        self._vertex_buffer = context.buffer(vertices.tobytes())
        self._texel_buffer = context.buffer(texels.tobytes())
        names = ("in_point", "in_texel", "in_sheet")
        self._array = context.vertex_array(
            self._program, [(self._vertex_buffer, "4f 2f 3i", *names)]
        )

    def _forget(self) -> None:
        if self._array is not None:
            for thing in (self._array, self._vertex_buffer, self._texel_buffer):
                thing.release()
            self._array = None
