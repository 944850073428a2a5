"""Depth maps of the whole scene, near geometry included, from eyes in a view cell.

A map holds, for one face of one eye, the disparity of the nearest surface at each texel, its colour
and its triangle. Maps depend on the eye alone, not on the cell, so neighbouring cells share those
of common corners through a `MapCache`.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple, Protocol

import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.render.target import VERTEX
from farfield_worker.visibility.blocks import ranges_in_view

Floats = NDArray[np.float64]

#: nothing nearer to the eye than this, in metres, is seen
NEAREST = 0.02

_FRAGMENT = """
uniform int first_triangle;
layout(location = 0) out uvec4 nearest;

void main() {
  vec3 color = surface(gl_FragCoord.xy);
  nearest = uvec4(floatBitsToUint(gl_FragCoord.w), packUnorm4x8(vec4(color, 1.0)),
    uint(first_triangle + gl_PrimitiveID), 0u);
}
"""


class DepthMap(NamedTuple):
    """The nearest surfaces on one face of one eye.

    Attributes:
        disparity: (resolution, resolution) float32, 1/m; 0 where there is nothing.
        color: (resolution, resolution) uint32, sRGB, RGBA8 packed; 0 where there is nothing.
        triangle: (resolution, resolution) int32; -1 where there is nothing.
    """

    disparity: NDArray[np.float32]
    color: NDArray[np.uint32]
    triangle: NDArray[np.int32]


class MapSource(Protocol):
    """Whatever makes depth maps."""

    resolution: int

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        ...


class DepthMapRenderer:
    """Draws depth maps. Create it in the process that uses it, never before a fork."""

    def __init__(self, scene: PreparedScene, resolution: int) -> None:
        self.scene = scene
        self.resolution = resolution
        with gl.current() as context:
            self.buffers = SceneBuffers(context, scene, VERTEX, _FRAGMENT)
            self._indices = context.buffer(np.ascontiguousarray(scene.triangles))
            self._arrays = self.buffers.vertex_arrays(self._indices)
            self._texture = context.texture((resolution, resolution), 4, dtype="u4")
            self._depth = gl.float_depth(context, (resolution, resolution))
            self._framebuffer = context.framebuffer([self._texture], self._depth)
            self._empty = np.tile(
                np.array([0, 0, 0xFFFFFFFF, 0], np.uint32), resolution * resolution
            ).tobytes()

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        ranges = ranges_in_view(self.scene, eye, face, NEAREST)
        _, right, down, forward = FACES[face]
        with gl.current() as context:
            self._framebuffer.use()
            context.enable_only(moderngl.DEPTH_TEST)
            context.front_face = "cw"
            self._framebuffer.clear(depth=0.0)
            self._texture.write(self._empty)
            self.buffers.set(
                eye=tuple((np.asarray(eye, np.float64) - self.scene.origin).astype(np.float32)),
                right=tuple(right),
                down=tuple(down),
                forward=tuple(forward),
                near=NEAREST,
            )
            bound = -1
            for batch, first, count in ranges.tolist():
                if batch != bound:
                    self.buffers.bind(self.buffers.batches[batch])
                    bound = batch
                self._arrays[batch].program["first_triangle"].value = first
                self._arrays[batch].render(vertices=3 * count, first=3 * first)
            data = np.frombuffer(self._texture.read(), np.uint32)
        pixels = np.ascontiguousarray(data.reshape(-1, 4).T).reshape(4, *(self.resolution,) * 2)
        return DepthMap(pixels[0].view(np.float32), pixels[1], pixels[2].view(np.int32))

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            for thing in (
                *self._arrays,
                self._indices,
                self._framebuffer,
                self._texture,
                self._depth,
            ):
                thing.release()
            self.buffers.release()


class MapCache:
    """Keeps the maps last used, by eye and face; eyes are equal within a millimetre."""

    def __init__(self, source: MapSource, capacity: int = 64) -> None:
        self.source = source
        self.resolution = source.resolution
        self.capacity = capacity
        self.made = 0
        self._maps: OrderedDict[tuple[int, int, int, int], DepthMap] = OrderedDict()

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        x, y, z = (round(float(c) * 1000) for c in eye)
        key = (x, y, z, face)
        found = self._maps.get(key)
        if found is None:
            found = self._maps[key] = self.source.map(eye, face)
            self.made += 1
            while len(self._maps) > self.capacity:
                self._maps.popitem(last=False)
        self._maps.move_to_end(key)
        return found
