"""Pictures of a prepared scene: a full render, every triangle at full detail."""

from __future__ import annotations

import moderngl
import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.scene_buffers import SceneBuffers, buffer
from farfield_worker.shoot.canvas import CAMERA, OUTPUTS, Canvas, camera
from farfield_worker.shoot.view import NearField, Picture, View

#: near clip where the view names none, metres
NEAR_CLIP = 0.1

_VERTEX = (
    CAMERA
    + """
uniform vec3 eye;
out vec3 v_position;

vec4 clip_position(vec3 position) {
  v_position = position;
  return clip_point(position - eye, 1.0);
}
"""
)

_FRAGMENT = (
    OUTPUTS
    + """
uniform vec4 near_field; // centre, half width
in vec3 v_position;

void main() {
  color = vec4(surface(pixel()), 1.0);
  vec3 offset = abs(v_position - near_field.xyz);
  far = max(offset.x, max(offset.y, offset.z)) > near_field.w ? 1.0 : 0.0;
}
"""
)


class SceneShooter:
    """Draws pictures of a prepared scene. Create it in the process that uses it."""

    def __init__(self, scene: PreparedScene) -> None:
        info = scene.info
        self._origin = scene.origin
        self._low = np.array([b.low for b in info.blocks], np.float64).reshape(-1, 3)
        self._high = np.array([b.high for b in info.blocks], np.float64).reshape(-1, 3)
        self._parts = np.array(
            sorted(
                (part.batch, number, part.first_triangle, part.triangles)
                for number, block in enumerate(info.blocks)
                for part in block.parts
            ),
            np.int64,
        ).reshape(-1, 4)
        with gl.current() as context:
            self._buffers = SceneBuffers(context, scene, _VERTEX, _FRAGMENT)
            self._indices = buffer(context, scene.triangles)
            self._arrays = self._buffers.vertex_arrays(self._indices)
            self._canvas = Canvas(context)

    def shoot(self, view: View, near_field: NearField | None = None) -> Picture:
        """Draw one picture; without a `near_field` nothing in it counts as far."""
        eye = np.asarray(view.eye, np.float64) - self._origin
        centre, half_width = near_field or NearField((0.0, 0.0, 0.0), np.inf)
        with gl.current():
            self._canvas.begin(view)
            self._buffers.set(
                eye=tuple(eye),
                near_field=(*(np.asarray(centre) - self._origin), half_width),
                **camera(view, NEAR_CLIP),
            )
            self._draw(self._visible(view, eye))
            return self._canvas.end()

    def _draw(self, visible: NDArray[np.bool_]) -> None:
        """Draw the visible blocks, one indirect draw per batch."""
        parts = self._parts[visible[self._parts[:, 1]]]
        if len(parts) == 0:
            return
        # count, instances, first index, base vertex, base instance
        commands = np.zeros((len(parts), 5), np.uint32)
        commands[:, 0], commands[:, 1], commands[:, 2] = 3 * parts[:, 3], 1, 3 * parts[:, 2]
        indirect = self._buffers.context.buffer(commands)
        starts = np.searchsorted(parts[:, 0], np.arange(len(self._arrays) + 1))
        for number, array in enumerate(self._arrays):
            first, end = int(starts[number]), int(starts[number + 1])
            if first < end:
                self._buffers.bind(number)
                array.render_indirect(indirect, moderngl.TRIANGLES, end - first, first)
        indirect.release()

    def _visible(self, view: View, eye: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Blocks whose bounds reach into the picture's frustum, (blocks,) bool."""
        right, up, forward = view.axes()
        visible = np.ones(len(self._low), np.bool_)
        widening = 1.0 + 2.0 * max(abs(n) for n in view.jitter) / view.size
        for side in (right, -right, up, -up):
            plane = widening * forward + view.focal * side
            reach = np.where(plane > 0, self._high, self._low) - eye
            # the shader works in float32
            visible &= reach @ plane >= -1e-5 * np.abs(reach).sum(axis=1) - 1e-3
        return visible

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            gl.release(*self._arrays, self._indices)
            self._buffers.release()
            self._canvas.release()
