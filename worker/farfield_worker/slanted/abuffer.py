"""An A-buffer of one face: every fragment beyond the near border (Carpenter 1984).

Surfaces that cross the near border are followed one texel further in, so that their quads can
reach the border itself and no crack shows there (slanted/near_border.py).

The scene is drawn once without a depth test; each fragment appends itself to a storage buffer. The
buffer holds what one binding may (llvmpipe: 128 MiB); where a face has more, its triangles are
drawn in as many parts as it takes. Material, sampling grid and border test are those of the
renderers (`render/`), so the nearest fragments equal a plain picture of the far field.
"""

from __future__ import annotations

import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.render.target import VERTEX
from farfield_worker.slanted.fragments import Fragments, sort_fragments
from farfield_worker.slanted.near_border import walls
from farfield_worker.visibility.clusters import Clusters

Floats = NDArray[np.float64]

_RECORD = 16
#: The near clip plane as a share of the near border's distance: far enough inside for the texels
#: that follow surfaces into the near field.
CLIP = 0.5
#: bytes of the storage buffer
_BYTES = 96 << 20

_FRAGMENT = """
layout(std430, binding = 0) buffer Count { uint count; };
layout(std430, binding = 1) writeonly buffer Records { uvec4 records[]; };
uniform vec3 walls[5];
uniform int resolution;
uniform int first;
uniform uint capacity;

void main() {
  vec3 color = surface(gl_FragCoord.xy);
#ifndef DOUBLE_SIDED
  if (!gl_FrontFacing) discard; // not by GL, see render/target.py
#endif
  vec3 w = vec3(2.0 * gl_FragCoord.xy / float(resolution) - 1.0, 1.0);
  float border = dot(walls[0], w);
  for (int i = 1; i < 5; i++) border = max(border, dot(walls[i], w));
  float disparity = gl_FragCoord.w;
  float inside = disparity - border;
  if (inside > fwidth(inside)) discard;
  uint place = atomicAdd(count, 1u);
  if (place < capacity) {
    uint texel = uint(gl_FragCoord.y) * uint(resolution) + uint(gl_FragCoord.x);
    records[place] = uvec4(texel, floatBitsToUint(disparity), packUnorm4x8(vec4(color, 1.0)),
      uint(first + gl_PrimitiveID));
  }
}
"""


class ABuffer:
    """Draws A-buffers of one scene. Create it in the process that uses it, never before a fork."""

    def __init__(
        self,
        scene: PreparedScene,
        clusters: Clusters | None = None,
        capacity: int = _BYTES // _RECORD,
    ) -> None:
        self.scene = scene
        self.capacity = capacity
        self._clusters = clusters or Clusters(scene)
        with gl.current() as context:
            self.buffers = SceneBuffers(context, scene, VERTEX, _FRAGMENT)
            self._count = context.buffer(reserve=16)
            self._records = context.buffer(reserve=capacity * _RECORD)
            self._framebuffer: moderngl.Framebuffer | None = None

    def fragments(
        self, eye: Floats, face: int, near: float, resolution: int, centre: Floats | None = None
    ) -> Fragments:
        """All fragments of `face` of `eye` (3,) outside the cube of half width `near`.

        The cube lies around `centre` (3,), which is the eye unless given. Where a surface enters
        the cube, its first texel inside is there as well.
        """
        middle = np.asarray(eye if centre is None else centre, np.float64)
        offset = np.asarray(eye, np.float64) - middle
        border = np.zeros((5, 3), np.float32)
        planes = walls(face, offset, near)
        border[:] = planes[0]
        border[: len(planes)] = planes
        # a wall is nearest where the eye leans to it
        nearest = CLIP * (near - float(np.abs(offset).max()))
        clusters = self._clusters.in_view(eye, face, nearest, resolution)
        vertices, triangles, starts = self._clusters.triangles(
            clusters, eye, face, nearest, resolution
        )
        runs = [
            (batch, int(starts[batch]), int(starts[batch + 1] - starts[batch]))
            for batch in np.flatnonzero(np.diff(starts)).tolist()
        ]
        records = [np.zeros((0, 4), np.uint32)]
        if runs:
            with gl.current() as context:
                self._begin(context, eye, face, nearest, resolution)
                self.buffers.set(walls=[tuple(w) for w in border])
                indices = context.buffer(vertices)
                arrays = self.buffers.vertex_arrays(indices)
                while runs:
                    batch, first, count = runs.pop()
                    found = self._draw(arrays[batch], batch, first, count)
                    if found <= self.capacity:
                        data = self._records.read(found * _RECORD) if found else b""
                        records.append(np.frombuffer(data, np.uint32).reshape(-1, 4))
                    else:
                        half = count // 2
                        runs += [(batch, first, half), (batch, first + half, count - half)]
                for thing in {id(a): a for a in arrays}.values():
                    thing.release()
                indices.release()
        return sort_fragments(np.concatenate(records), triangles, resolution)

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            for thing in (self._count, self._records):
                thing.release()
            self._release_framebuffer()
            self.buffers.release()

    def _release_framebuffer(self) -> None:
        if self._framebuffer is not None:
            gl.release_framebuffer(self._framebuffer)
            self._framebuffer = None

    def _begin(
        self, context: moderngl.Context, eye: Floats, face: int, near_clip: float, resolution: int
    ) -> None:
        if self._framebuffer is None or self._framebuffer.width != resolution:
            self._release_framebuffer()
            picture = context.texture((resolution, resolution), 1)
            self._framebuffer = context.framebuffer([picture])
        self._framebuffer.use()
        context.enable_only(moderngl.NOTHING)
        context.front_face = "cw"
        _, right, down, forward = FACES[face]
        self.buffers.set(
            eye=tuple((np.asarray(eye, np.float64) - self.scene.origin).astype(np.float32)),
            right=tuple(right),
            down=tuple(down),
            forward=tuple(forward),
            near=near_clip,
            resolution=resolution,
            capacity=self.capacity,
        )
        self._count.bind_to_storage_buffer(0)
        self._records.bind_to_storage_buffer(1)

    def _draw(self, array: moderngl.VertexArray, batch: int, first: int, count: int) -> int:
        """Draw `count` triangles of a batch from the `first`; return how many fragments."""
        self._count.write(bytes(16))
        self.buffers.bind(batch, cull=False)
        set_uniforms(array.program, first=first)
        array.render(vertices=3 * count, first=3 * first)
        self.buffers.context.memory_barrier()
        return int(np.frombuffer(self._count.read(4), np.uint32)[0])
