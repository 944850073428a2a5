"""Pictures of a few triangles: disparity, colour and triangle of the nearest at each texel.

What colour a surface has its textures and the light tell; so this is drawn by GL, with the
renderers' materials.
"""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.render.target import VERTEX
from farfield_worker.visibility.clusters import ByBatch

Floats = NDArray[np.float64]

_FRAGMENT = """
uniform int first;
layout(location = 0) out float disparity;
layout(location = 1) out uvec2 surface_seen;

void main() {
  vec3 color = surface(gl_FragCoord.xy);
#ifndef DOUBLE_SIDED
  if (!gl_FrontFacing) discard; // not by GL, see render/target.py
#endif
  disparity = gl_FragCoord.w;
  surface_seen = uvec2(packUnorm4x8(vec4(color, 1.0)), uint(first + gl_PrimitiveID));
}
"""


class Picture(NamedTuple):
    """What triangles show on one face of one eye.

    Attributes:
        disparity: (resolution, resolution) float32, 1/m; 0 where there is nothing.
        color: (resolution, resolution) uint32, sRGB, RGBA8 packed; 0 where there is nothing.
        triangle: (resolution, resolution) int32; -1 where there is nothing.
    """

    disparity: NDArray[np.float32]
    color: NDArray[np.uint32]
    triangle: NDArray[np.int32]


class Pictures:
    """Draws pictures of a scene's triangles. Create it in the process that uses it."""

    def __init__(self, scene: PreparedScene, resolution: int) -> None:
        self.scene = scene
        self.resolution = resolution
        with gl.current() as context:
            self.buffers = SceneBuffers(context, scene, VERTEX, _FRAGMENT)
            self._disparity = context.texture((resolution, resolution), 1, dtype="f4")
            self._surface = context.texture((resolution, resolution), 2, dtype="u4")
            self._depth = gl.float_depth(context, (resolution, resolution))
            self._framebuffer = context.framebuffer([self._disparity, self._surface], self._depth)

    def draw(self, eye: Floats, face: int, nearest: float, triangles: ByBatch) -> Picture:
        """Picture of `triangles` beyond Z = `nearest` on `face` of `eye` (3,)."""
        _, right, down, forward = FACES[face]
        with gl.current() as context:
            self._framebuffer.use()
            context.enable_only(moderngl.DEPTH_TEST)
            context.front_face = "cw"
            # this leaves integers undefined, so surfaces count only where there is a disparity
            self._framebuffer.clear(depth=0.0)
            self.buffers.set(
                eye=tuple((np.asarray(eye, np.float64) - self.scene.origin).astype(np.float32)),
                right=tuple(right),
                down=tuple(down),
                forward=tuple(forward),
                near=nearest,
            )
            indices = context.buffer(triangles.vertices)
            arrays = self.buffers.vertex_arrays(indices)
            starts = triangles.starts
            for batch in np.flatnonzero(np.diff(starts)).tolist():
                self.buffers.bind(batch, cull=False)
                first, count = int(starts[batch]), int(starts[batch + 1] - starts[batch])
                set_uniforms(arrays[batch].program, first=first)
                arrays[batch].render(vertices=3 * count, first=3 * first)
            for thing in {id(a): a for a in arrays}.values():
                thing.release()
            indices.release()
            size = (self.resolution, self.resolution)
            disparity = np.frombuffer(self._disparity.read(), np.float32).reshape(size)
            data = np.frombuffer(self._surface.read(), np.uint32).reshape(*size, 2)
        seen = disparity > 0
        color = np.where(seen, data[..., 0], np.uint32(0))
        triangle = np.full(size, -1, np.int32)
        triangle[seen] = triangles.triangles[data[..., 1][seen]]
        return Picture(disparity, color, triangle)

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            gl.release_framebuffer(self._framebuffer)
            self.buffers.release()
