"""Maps of a cell's near polygons alone, clipped to the near field, from eyes in the cell.

Eye and near field are convex: whatever hides a near polygon from an eye inside is near itself, so
the rest of the scene need not be drawn. A map tells which triangle shows at each texel, and how far
away the nearest thing is that nothing can be seen through. Where that is nothing, the eye looks out
of the near field.

Foliage (MASK) hides what is behind it only where its texture is opaque all around a texel, screened
glass (BLEND) hides nothing: seen closer than a map shows it, either may have holes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np
from farfield_core.faces import FACES
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray

from farfield_worker.gl import context as gl
from farfield_worker.gl.programs import set_uniforms
from farfield_worker.gl.scene_buffers import SceneBuffers
from farfield_worker.visibility.clusters import Clusters, InView
from farfield_worker.visibility.depth_maps import NEAREST
from farfield_worker.visibility.pyramid import not_behind

Floats = NDArray[np.float64]

#: triangles drawn before the others are tested against what is drawn already
FIRST = 20_000
#: mean opacity of a texel's area from which it counts as opaque all over
SOLID = 0.95

#: as render/target.py, and the point's position for clipping
_VERTEX = """
uniform vec3 eye;
uniform vec3 right;
uniform vec3 down;
uniform vec3 forward;
uniform float near;
out vec3 v_point;

vec4 clip_position(vec3 position) {
  v_point = position;
  vec3 q = position - eye;
  return vec4(dot(q, right), dot(q, down), near, dot(q, forward));
}
"""

_FRAGMENT = """
uniform vec3 centre;
uniform float near_field;
uniform float least_opacity;
uniform int first;
in vec3 v_point;
layout(location = 0) out vec2 seen;

void main() {
  float opacity = v_color.a;
#ifdef TEXTURED
  opacity *= texture(base_texture, v_uv).a;
#endif
#ifdef ALPHA_MASK
  if (opacity < max(cutoff, least_opacity)) discard;
#endif
#ifdef ALPHA_DITHER
  if (least_opacity > 0.0 || !ff_dither(opacity, gl_FragCoord.xy)) discard;
#endif
#ifndef DOUBLE_SIDED
  if (!gl_FrontFacing) discard; // not by GL, see render/target.py
#endif
  vec3 offset = abs(v_point - centre);
  if (max(offset.x, max(offset.y, offset.z)) > near_field) discard;
  seen = vec2(gl_FragCoord.w, float(first + gl_PrimitiveID + 1));
}
"""


class NearMap(NamedTuple):
    """What of the near field one face of one eye shows.

    Attributes:
        solid: (resolution, resolution) float32, disparity of the nearest surface that hides what
            is behind it, 1/m; 0 where there is none.
        triangle: (resolution, resolution) int32, what shows, of the scene; -1 where nothing does.
    """

    solid: NDArray[np.float32]
    triangle: NDArray[np.int32]


class NearMapRenderer:
    """Draws near maps. Create it in the process that uses it, never before a fork."""

    def __init__(self, scene: PreparedScene, resolution: int) -> None:
        self.scene = scene
        self.resolution = resolution
        self._all = Clusters(scene)
        self._near = self._all
        self._opaque = np.array([b.alpha == "opaque" for b in scene.info.batches], np.bool_)
        with gl.current() as context:
            self.buffers = SceneBuffers(context, scene, _VERTEX, _FRAGMENT)
            self._picture = context.texture((resolution, resolution), 2, dtype="f4")
            depth = gl.float_depth(context, (resolution, resolution))
            self._framebuffer = context.framebuffer([self._picture], depth)

    def enter(self, centre: Floats, half_width: float) -> None:
        """From now on draw the near field of `half_width` around `centre` (3,), scene axes."""
        middle = np.asarray(centre, np.float64) - self.scene.origin
        self._near = self._all.meeting(middle, half_width)
        with gl.current():
            self.buffers.set(centre=tuple(middle.astype(np.float32)), near_field=half_width)

    def map(self, eye: Floats, face: int) -> NearMap:
        """Near map of `face` of `eye` (3,), scene coordinates."""
        _, right, down, forward = FACES[face]
        view = self._near.in_view(eye, face, NEAREST, self.resolution)
        opaque = self._opaque[self._near.runs[view.cluster, 0]]
        rest, holey = view.take(opaque), view.take(~opaque)
        some = int(np.searchsorted(np.cumsum(rest.triangles), FIRST)) + 1
        with gl.current() as context:
            self._framebuffer.use()
            context.enable_only(moderngl.DEPTH_TEST)
            context.front_face = "cw"
            self._framebuffer.clear(depth=0.0)
            self.buffers.set(
                eye=tuple((np.asarray(eye, np.float64) - self.scene.origin).astype(np.float32)),
                right=tuple(right),
                down=tuple(down),
                forward=tuple(forward),
                near=NEAREST,
                least_opacity=SOLID,
            )
            ids = [np.full(1, -1, np.int32)]
            ids.append(self._draw(context, rest.take(slice(some)), eye, face, 0))
            rest = rest.take(slice(some, None))
            if len(rest.cluster):
                rest = not_behind(rest, self._shown()[..., 0])
                ids.append(self._draw(context, rest, eye, face, sum(map(len, ids)) - 1))
            if len(holey.cluster):
                ids.append(self._draw(context, holey, eye, face, sum(map(len, ids)) - 1))
            shown = self._shown()
            solid = shown[..., 0]
            if len(holey.cluster):
                self.buffers.set(least_opacity=0.0)
                holey = not_behind(holey, solid)
                ids.append(self._draw(context, holey, eye, face, sum(map(len, ids)) - 1))
                shown = self._shown()
        return NearMap(solid, np.concatenate(ids)[shown[..., 1].astype(np.int32)])

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            gl.release_framebuffer(self._framebuffer)
            self.buffers.release()

    def _draw(
        self, context: moderngl.Context, clusters: InView, eye: Floats, face: int, first: int
    ) -> NDArray[np.int32]:
        """Draw `clusters`, numbering their triangles from `first`; return the triangles."""
        vertices, triangles, starts = self._near.triangles(
            clusters, eye, face, NEAREST, self.resolution
        )
        if len(triangles) == 0:
            return triangles
        indices = context.buffer(vertices)
        arrays = self.buffers.vertex_arrays(indices)
        for batch in np.flatnonzero(np.diff(starts)).tolist():
            self.buffers.bind(batch, cull=False)
            set_uniforms(arrays[batch].program, first=first + int(starts[batch]))
            arrays[batch].render(
                vertices=3 * int(starts[batch + 1] - starts[batch]), first=3 * int(starts[batch])
            )
        for thing in {id(a): a for a in arrays}.values():
            thing.release()
        indices.release()
        return triangles

    def _shown(self) -> NDArray[np.float32]:
        """What is drawn so far: (h, w, 2) float32, disparity and number of the triangle from 1."""
        data = np.frombuffer(self._picture.read(), np.float32)
        return data.reshape(self.resolution, self.resolution, 2)


def farthest_around(disparity: NDArray[np.float32], texels: int = 1) -> NDArray[np.float32]:
    """Least disparity within `texels` of each texel of a map (h, w), both ways: (h, w) float32."""
    around = disparity
    for _ in range(texels):
        around = _least_of_nine(around)
    return around


@njit(cache=True)
def _least_of_nine(values: Any) -> Any:
    """Least of each value and its eight neighbours, those outside (h, w) left out."""
    h, w = values.shape
    rows, out = np.empty((h, w), np.float32), np.empty((h, w), np.float32)
    for y in range(h):
        above, below = max(y - 1, 0), min(y + 1, h - 1)
        for x in range(w):
            rows[y, x] = min(values[above, x], values[y, x], values[below, x])
    for y in range(h):
        for x in range(w):
            left, right = max(x - 1, 0), min(x + 1, w - 1)
            out[y, x] = min(rows[y, left], rows[y, x], rows[y, right])
    return out
