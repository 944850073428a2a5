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
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.render.target import VERTEX
from farfield_worker.visibility.clusters import Clusters, InView

Floats = NDArray[np.float64]

#: nothing nearer to the eye than this, in metres, is seen
NEAREST = 0.02

#: triangles drawn before each test against what is drawn already
ROUNDS = (40_000, 120_000)

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
    """Draws depth maps. Create it in the process that uses it, never before a fork.

    The nearest clusters of triangles are drawn first; the others only where those do not hide them.
    """

    def __init__(
        self, scene: PreparedScene, resolution: int, clusters: Clusters | None = None
    ) -> None:
        self.scene = scene
        self.resolution = resolution
        self._clusters = clusters or Clusters(scene)
        with gl.current() as context:
            self.buffers = SceneBuffers(context, scene, VERTEX, _FRAGMENT)
            self._disparity = context.texture((resolution, resolution), 1, dtype="f4")
            self._surface = context.texture((resolution, resolution), 2, dtype="u4")
            self._depth = gl.float_depth(context, (resolution, resolution))
            self._framebuffer = context.framebuffer([self._disparity, self._surface], self._depth)

    def map(self, eye: Floats, face: int) -> DepthMap:
        """Depth map of `face` of `eye` (3,), scene coordinates."""
        _, right, down, forward = FACES[face]
        rest = self._clusters.in_view(eye, face, NEAREST, self.resolution)
        ids = [np.zeros(0, np.int32)]
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
                near=NEAREST,
            )
            for budget in ROUNDS:
                some = int(np.searchsorted(np.cumsum(rest.triangles), budget))
                ids.append(
                    self._draw(context, rest.take(slice(some)), eye, face, sum(map(len, ids)))
                )
                rest = rest.take(slice(some, None))
                if len(rest.cluster) == 0:
                    break
                rest = self._clusters.not_hidden(rest, self._shown())
            ids.append(self._draw(context, rest, eye, face, sum(map(len, ids))))
            disparity = self._shown()
            data = np.frombuffer(self._surface.read(), np.uint32)
        seen = disparity > 0
        color, drawn = data.reshape(*disparity.shape, 2).transpose(2, 0, 1)
        triangle = np.full(disparity.shape, -1, np.int32)
        triangle[seen] = np.concatenate(ids)[drawn[seen]]
        return DepthMap(disparity, np.where(seen, color, np.uint32(0)), triangle)

    def _draw(
        self, context: moderngl.Context, clusters: InView, eye: Floats, face: int, first: int
    ) -> NDArray[np.int32]:
        """Draw `clusters`, numbering their triangles from `first`; return the triangles."""
        vertices, triangles, starts = self._clusters.triangles(
            clusters, eye, face, NEAREST, self.resolution
        )
        if len(triangles) == 0:
            return triangles
        indices = context.buffer(vertices)
        arrays = self.buffers.vertex_arrays(indices)
        for batch in np.flatnonzero(np.diff(starts)).tolist():
            self.buffers.bind(self.buffers.batches[batch], cull=False)
            set_uniforms(arrays[batch].program, first=first + int(starts[batch]))
            arrays[batch].render(
                vertices=3 * int(starts[batch + 1] - starts[batch]), first=3 * int(starts[batch])
            )
        for thing in {id(a): a for a in arrays}.values():
            thing.release()
        indices.release()
        return triangles

    def _shown(self) -> NDArray[np.float32]:
        """Disparities drawn so far, (h, w) float32, 0 where nothing is."""
        data = np.frombuffer(self._disparity.read(), np.float32)
        return data.reshape(self.resolution, self.resolution)

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            gl.release_framebuffer(self._framebuffer)
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
