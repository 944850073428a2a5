"""What both moderngl renderers draw a face into: projection, layer test, framebuffer."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.render.borders import near_clip

#: Row 0 of the framebuffer is the face's top row, so y runs along `down` and windings flip.
VERTEX = """
uniform vec3 eye;
uniform vec3 right;
uniform vec3 down;
uniform vec3 forward;
uniform float near;

vec4 clip_position(vec3 position) {
  vec3 q = position - eye;
  return vec4(dot(q, right), dot(q, down), near, dot(q, forward));
}
"""

#: `layer` holds the layer's least (excluded) and greatest depth, see `borders`.
#: The tests follow all texture reads, whose derivatives need the neighbouring fragments.
#: Back faces are dropped here and not by GL: Mesa culls by unrounded corners where a draw has to be
#: clipped and by rounded ones where it has not, so a sliver would depend on what is drawn with it.
FRAGMENT = """
uniform vec2 layer;
layout(location = 0) out uvec2 texel;

void main() {
  vec3 color = surface(gl_FragCoord.xy);
  float depth = gl_FragCoord.z;
  if (depth <= layer.x || depth > layer.y) discard;
#ifndef DOUBLE_SIDED
  if (!gl_FrontFacing) discard;
#endif
  texel = uvec2(packUnorm4x8(vec4(color, 1.0)), floatBitsToUint(depth));
}
"""


class FaceTarget:
    """A scene on the GPU and a framebuffer of packed colours and depths.

    The framebuffer's texels are (RGBA8 as one uint32, float32 depth's bits); zero is empty.
    """

    def __init__(self, scene: PreparedScene) -> None:
        with gl.current() as context:
            self.context = context
            self.name = gl.device_name(context)
            self.scene = scene
            self.buffers = SceneBuffers(context, scene, VERTEX, FRAGMENT)
            self.size = 0
            self.framebuffer: moderngl.Framebuffer | None = None

    def begin(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], size: int
    ) -> moderngl.Framebuffer:
        """Bind a cleared framebuffer of `size` texels and set up the camera."""
        if self.framebuffer is None or self.size != size:
            self._release_framebuffer()
            self._colors = self.context.texture((size, size), 2, dtype="u4")
            depth = gl.float_depth(self.context, (size, size))
            self.framebuffer = self.context.framebuffer([self._colors], depth)
            self._zeros = bytes(8 * size * size)
            self.size = size
        _, right, down, forward = FACES[face]
        self.buffers.set(
            eye=tuple(self.eye(eye)),
            right=tuple(right),
            down=tuple(down),
            forward=tuple(forward),
            near=float(near_clip(borders)),
        )
        self.framebuffer.use()
        self.context.enable_only(moderngl.DEPTH_TEST)
        self.context.front_face = "cw"
        self.clear()
        return self.framebuffer

    def clear(self) -> None:
        """Empty the framebuffer."""
        assert self.framebuffer is not None
        # glClear leaves integer colours undefined, so they are overwritten instead.
        self.framebuffer.clear(depth=0.0)
        self._colors.write(self._zeros)

    def eye(self, eye: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return `eye` relative to the scene's origin as the shader gets it, (3,) float32."""
        return (np.asarray(eye, np.float64) - self.scene.origin).astype(np.float32)

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            self._release_framebuffer()
            self.buffers.release()

    def _release_framebuffer(self) -> None:
        if self.framebuffer is not None:
            gl.release_framebuffer(self.framebuffer)
            self.framebuffer = None
