"""Far quads of a cell (docs/format.md, "Drawing a quad")."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl
import numpy as np
from farfield_core.errors import BadInputError
from farfield_core.faces import FACES
from farfield_core.walk import CellFile, Quads, Walk
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.gl.scene_buffers import buffer
from farfield_worker.shoot.canvas import CAMERA, OUTPUTS

_VERTEX = (
    CAMERA
    + """
uniform vec3 eye;
in vec4 in_position;
in vec3 in_texel;
out vec2 v_texel;
flat out int v_page;

void main() {
  v_texel = in_texel.xy;
  v_page = int(in_texel.z);
  gl_Position = clip_point(in_position.xyz - in_position.w * eye, in_position.w);
}
"""
)

_FRAGMENT = (
    OUTPUTS
    + """
uniform sampler2DArray pages;
in vec2 v_texel;
flat in int v_page;

void main() {
  // its plane lies between this eye and the quad's own
  if (!gl_FrontFacing) discard;
  vec4 texel = texelFetch(pages, ivec3(floor(v_texel), v_page), 0);
  if (texel.a < 0.5) discard;
  color = vec4(texel.rgb, 1.0);
  far = 1.0;
}
"""
)


class QuadVertices(NamedTuple):
    """Quads as triangle fans.

    Attributes:
        positions: (n, 4) float32, homogeneous, relative to the cell's centre.
        texels: (n, 3) float32, column and row on the page, and the page.
        triangles: (m, 3) uint32, in the order of the quads, counter-clockwise from their own eye.
    """

    positions: NDArray[np.float32]
    texels: NDArray[np.float32]
    triangles: NDArray[np.uint32]


def quad_vertices(
    quads: Quads,
    eyes: NDArray[np.float64],
    centre: NDArray[np.float64],
    resolution: int,
    pages: int,
) -> QuadVertices:
    """Vertices of `quads`, `eyes` (n, 3) being the cell's; raises BadInputError if they are odd."""
    counts = np.array(quads.corner_counts, np.int64)
    face, eye = np.array(quads.faces, np.int64), np.array(quads.eyes, np.int64)
    page = np.array(quads.pages, np.int64)
    _check(quads, counts)
    for column, values, limit in (
        ("faces", face, 6),
        ("eyes", eye, len(eyes)),
        ("pages", page, pages),
    ):
        if ((values < 0) | (values >= limit)).any():
            raise BadInputError(
                f"The quads' column {column} refers to something that is not there."
            )
    quad = np.repeat(np.arange(len(counts)), counts)
    corners = np.array(quads.corners, np.float64).reshape(-1, 2)
    uv = 2.0 * corners / resolution - 1.0
    plane = np.array(quads.planes, np.float64).reshape(-1, 3)[quad]
    d = np.maximum(plane[:, 0] * uv[:, 0] + plane[:, 1] * uv[:, 1] + plane[:, 2], 0.0)
    right, down, forward = (
        np.stack([getattr(f, axis) for f in FACES])[face][quad]
        for axis in ("right", "down", "forward")
    )
    direction = forward + uv[:, :1] * right + uv[:, 1:] * down
    position = direction + d[:, None] * (eyes[eye] - centre)[quad]
    turned = np.array(quads.turned, np.bool_)[quad]
    along = np.where(turned[:, None], corners[:, ::-1], corners)
    scale = np.array(quads.scales, np.float64)[quad]
    offset = np.array(quads.offsets, np.float64).reshape(-1, 2)[quad]
    texel = scale[:, None] * along + offset
    # the fan of quad q: (first, first + 1, first + 2), (first, first + 2, first + 3), ...
    first = np.cumsum(counts) - counts
    fans = np.repeat(np.arange(len(counts)), counts - 2)
    step = np.arange(len(fans)) - np.repeat(np.cumsum(counts - 2) - (counts - 2), counts - 2)
    start = first[fans]
    ahead, behind = start + step + 1, start + step + 2
    # corners may go round either way; in rows that go down, a positive area is clockwise
    clockwise = _areas(corners, first)[fans] > 0
    second, third = np.where(clockwise, (behind, ahead), (ahead, behind))
    return QuadVertices(
        np.concatenate([position, d[:, None]], axis=1).astype(np.float32),
        np.concatenate([texel, page[quad][:, None]], axis=1).astype(np.float32),
        np.stack([start, second, third], axis=1).astype(np.uint32),
    )


def _areas(corners: NDArray[np.float64], first: NDArray[np.int64]) -> NDArray[np.float64]:
    """Twice the signed areas of polygons, whose `corners` (n, 2) begin at `first` (q,): (q,)."""
    if len(first) == 0:
        return np.zeros(0)
    after = np.arange(1, len(corners) + 1)
    after[np.append(first[1:], len(corners)) - 1] = first
    cross = corners[:, 0] * corners[after, 1] - corners[:, 1] * corners[after, 0]
    return np.asarray(np.add.reduceat(cross, first))


def _check(quads: Quads, counts: NDArray[np.int64]) -> None:
    """Refuse columns that do not fit together."""
    if ((counts < 3) | (counts > 8)).any():
        raise BadInputError("A quad of the cell has fewer than 3 or more than 8 corners.")
    expected = {
        "faces": 1,
        "eyes": 1,
        "pages": 1,
        "planes": 3,
        "scales": 1,
        "offsets": 2,
        "turned": 1,
    }
    lengths = {name: width * len(counts) for name, width in expected.items()}
    lengths["corners"] = 2 * int(counts.sum())
    for name, length in lengths.items():
        if len(getattr(quads, name)) != length:
            raise BadInputError(f"The quads' column {name} does not have {length} entries.")


class FarQuads:
    """The quads of one cell on the GPU."""

    def __init__(
        self,
        context: moderngl.Context,
        cell: CellFile,
        walk: Walk,
        read: Callable[[str], bytes],
    ) -> None:
        eyes = np.array(cell.eyes, np.float64).reshape(-1, 3)
        vertices = quad_vertices(cell.quads, eyes, eyes[0], walk.resolution, len(cell.atlases))
        self._context = context
        self._program = context.program(
            vertex_shader=f"#version 450 core\n{_VERTEX}",
            fragment_shader=f"#version 450 core\n{_FRAGMENT}",
        )
        size = (walk.atlas.width, walk.atlas.height, max(len(cell.atlases), 1))
        self._pages = context.texture_array(size, 4)
        self._pages.filter = (moderngl.NEAREST, moderngl.NEAREST)
        for number, name in enumerate(cell.atlases):
            with Image.open(io.BytesIO(read(name))) as image:
                if image.width > walk.atlas.width or image.height > walk.atlas.height:
                    raise BadInputError(f"Atlas page {name} is larger than walk.json says.")
                self._pages.write(
                    image.convert("RGBA").tobytes(), (0, 0, number, image.width, image.height, 1)
                )
        self._buffers = [buffer(context, array) for array in vertices]
        positions, texels, triangles = self._buffers
        self._array = context.vertex_array(
            self._program,
            [(positions, "4f", "in_position"), (texels, "3f", "in_texel")],
            triangles,
            index_element_size=4,
        )
        self._count = 3 * len(vertices.triangles)

    def draw(self, camera: dict[str, Any], eye: NDArray[np.float64]) -> None:
        """Draw all quads in order; `eye` is relative to the cell's centre."""
        if self._count == 0:
            return
        set_uniforms(self._program, eye=tuple(eye), pages=0, **camera)
        gl.cull_back_faces(self._context, False)
        self._pages.use(0)
        self._array.render(vertices=self._count)

    def release(self) -> None:
        """Free what the GPU holds."""
        gl.release(self._array, *self._buffers, self._pages, self._program)
