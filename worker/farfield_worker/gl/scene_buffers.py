"""A prepared scene on the GPU: vertex buffers, textures, programs."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from farfield_core.scene import PreparedScene, Triple
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl import textures
from farfield_worker.gl.material import Features
from farfield_worker.gl.programs import Programs, set_uniforms


class SceneBuffers:
    """Vertices and textures of a prepared scene, uploaded once, and programs to draw them with.

    `vertex_glsl` and `fragment_glsl` are those of `Programs`; positions are relative to the
    scene's origin.
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
        arrays: dict[str, NDArray[Any]] = {
            "position": scene.positions,
            "uv": scene.uvs,
            "normal": scene.normals,
            "color": scene.colors,
        }
        self._buffers = {name: buffer(context, array) for name, array in arrays.items()}
        self._textures = [
            textures.upload_file(
                context, scene.folder / "textures" / t.file, t.wrap_u, t.wrap_v, t.filter
            )
            for t in scene.info.textures
        ]
        self._features = [Features.of(batch) for batch in self.batches]
        #: emissive factor and cutoff that each program has now
        self._bound: dict[Features, tuple[Triple, float]] = {}
        self._programs = Programs(context, vertex_glsl, fragment_glsl)
        for features in self._features:
            self._programs.get(features)

    def vertex_arrays(self, indices: moderngl.Buffer) -> list[moderngl.VertexArray]:
        """One vertex array per batch, drawing from `indices` (uint32)."""
        arrays = {
            features: self._programs.vertex_array(features, self._buffers, indices)
            for features in set(self._features)
        }
        return [arrays[features] for features in self._features]

    def set(self, **values: Any) -> None:
        """Set uniforms in all programs."""
        self._programs.set(**values)

    def bind(self, number: int, cull: bool = True) -> None:
        """Set a batch's textures, uniforms and, if `cull`, whether back faces are dropped."""
        batch, features = self.batches[number], self._features[number]
        bound = batch.emissive, batch.cutoff
        # Setting a uniform takes as long as drawing a few triangles.
        if self._bound.get(features) != bound:
            self._bound[features] = bound
            set_uniforms(
                self._programs.get(features), emissive_factor=batch.emissive, cutoff=batch.cutoff
            )
        if batch.texture is not None:
            self._textures[batch.texture].use(0)
        if batch.emissive_texture is not None:
            self._textures[batch.emissive_texture].use(1)
        gl.cull_back_faces(self.context, cull and not batch.double_sided)

    def release(self) -> None:
        """Free what the GPU holds."""
        gl.release(*self._buffers.values(), *self._textures)
        self._programs.release()


def buffer(context: moderngl.Context, array: NDArray[Any]) -> moderngl.Buffer:
    """Upload an array of any shape."""
    # moderngl refuses empty buffers
    return context.buffer(np.ascontiguousarray(array)) if len(array) else context.buffer(reserve=16)
