"""The obvious renderer: for every layer, clear, draw the whole scene, read everything back.

It is what the culled renderer must equal texel for texel, and is used as the oracle in its tests.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.render.borders import border_depths, near_clip
from farfield_worker.render.interface import FaceTexels
from farfield_worker.render.target import FaceTarget
from farfield_worker.render.texels import LayerTexels, merge


class PlainRenderer:
    """Draws every triangle for every layer."""

    def __init__(self, scene: PreparedScene) -> None:
        self._target = FaceTarget(scene)
        self.name = self._target.name
        self._scene = scene
        with gl.current() as context:
            self._indices = context.buffer(np.ascontiguousarray(scene.triangles))
            self._arrays = self._target.buffers.vertex_arrays(self._indices)

    def face(
        self, eye: NDArray[np.float64], face: int, borders: Sequence[float], resolution: int
    ) -> FaceTexels:
        """See `Renderer.face`."""
        depths, near = border_depths(borders), near_clip(borders)
        layers = []
        with gl.current():
            framebuffer = self._target.begin(eye, face, borders, resolution)
            for layer in range(len(borders)):
                self._target.clear()
                self._draw(float(depths[layer]), float(depths[layer + 1]))
                data = framebuffer.read(components=2, dtype="u4")
                color, bits = np.frombuffer(data, np.uint32).reshape(-1, 2).T
                texel = np.flatnonzero(bits).astype(np.int32)
                distance = near / bits[texel].view(np.float32)
                layers.append((layer, LayerTexels(texel, color[texel], distance)))
        return merge(layers, resolution)

    def _draw(self, least: float, greatest: float) -> None:
        buffers = self._target.buffers
        buffers.set(layer=(least, greatest))
        for number in range(len(buffers.batches)):
            buffers.bind(number, cull=False)
            for block in self._scene.info.blocks:
                for part in block.parts:
                    if part.batch == number:
                        self._arrays[number].render(
                            vertices=3 * part.triangles, first=3 * part.first_triangle
                        )

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            gl.release(*self._arrays, self._indices)
        self._target.close()
