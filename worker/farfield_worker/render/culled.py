"""The default renderer: every layer draws only the triangles that can show in it.

Layers are drawn far to near into one framebuffer that is cleared once per face. Anything a layer
draws lies nearer than all that farther layers have left behind, so the depth test lets it through,
and what was left behind is known by its depth when the layer's rectangle is read back.
"""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.render.borders import border_depths, near_clip
from farfield_worker.render.culling import Culler, Lists
from farfield_worker.render.interface import FaceTexels
from farfield_worker.render.target import FaceTarget
from farfield_worker.render.texels import LayerTexels, collect, merge


class CulledRenderer:
    """Draws, per face and layer, what is left of the scene after culling."""

    def __init__(self, scene: PreparedScene) -> None:
        self._target = FaceTarget(scene)
        self.name = self._target.name
        self._culler = Culler(scene)
        self._indices: moderngl.Buffer | None = None
        self._arrays: list[moderngl.VertexArray] = []
        self._readback = np.empty(0, np.uint32)

    def face(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], resolution: int
    ) -> FaceTexels:
        """See `Renderer.face`."""
        depths, near = border_depths(borders), near_clip(borders)
        lists = self._culler.lists(self._target.eye(eye), face, depths, near, resolution)
        layers = []
        if len(lists.indices):
            with gl.current():
                self._upload(lists.indices)
                framebuffer = self._target.begin(eye, face, borders, resolution)
                for layer in range(len(borders)):
                    if lists.rectangles[layer, 0] < lists.rectangles[layer, 2]:
                        texels = self._layer(framebuffer, lists, layer, depths, near)
                        layers.append((layer, texels))
                framebuffer.scissor = framebuffer.viewport
        return merge(layers, resolution)

    def _layer(
        self,
        framebuffer: moderngl.Framebuffer,
        lists: Lists,
        layer: int,
        depths: NDArray[np.float32],
        near: np.float32,
    ) -> LayerTexels:
        """Draw one layer and read back what it covers."""
        x0, y0, x1, y1 = (int(edge) for edge in lists.rectangles[layer])
        framebuffer.scissor = (x0, y0, x1 - x0, y1 - y0)
        buffers = self._target.buffers
        buffers.set(layer=(float(depths[layer]), float(depths[layer + 1])))
        starts = lists.starts[layer]
        for number in np.flatnonzero(starts[1:] > starts[:-1]).tolist():
            buffers.bind(number, cull=False)
            first, end = int(starts[number]), int(starts[number + 1])
            self._arrays[number].render(vertices=3 * (end - first), first=3 * first)
        pixels = self._readback[: 2 * (x1 - x0) * (y1 - y0)]
        if len(pixels) < 2 * (x1 - x0) * (y1 - y0):
            self._readback = np.empty(2 * self._target.size**2, np.uint32)
            pixels = self._readback[: 2 * (x1 - x0) * (y1 - y0)]
        framebuffer.read_into(pixels, (x0, y0, x1 - x0, y1 - y0), components=2, dtype="u4")
        rectangle = pixels.reshape(y1 - y0, x1 - x0, 2)
        return collect(rectangle, x0, y0, self._target.size, depths[layer], near)

    def _upload(self, indices: NDArray[np.uint32]) -> None:
        """Put the index lists where the vertex arrays read them."""
        if self._indices is None or self._indices.size < indices.nbytes:
            self._release_indices()
            self._indices = self._target.context.buffer(reserve=2 * indices.nbytes, dynamic=True)
            self._arrays = self._target.buffers.vertex_arrays(self._indices)
        self._indices.orphan()
        self._indices.write(indices)

    def _release_indices(self) -> None:
        if self._indices is not None:
            gl.release(*self._arrays, self._indices)
            self._indices, self._arrays = None, []

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            self._release_indices()
        self._target.close()
