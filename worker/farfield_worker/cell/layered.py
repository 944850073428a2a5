"""The layer bake of one cell (LEMI sections 3 to 5): render every layer, compile, lay out."""

from __future__ import annotations

import numpy as np
from farfield_core import faces as face_axes
from farfield_core import placement
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import Walk
from numpy.typing import NDArray

from farfield_worker.cell.impostors import Impostors, Stopwatch, triple
from farfield_worker.cell.sight import Sight
from farfield_worker.compile.atlas import lay_out
from farfield_worker.compile.layered import CompiledFace, Rules, compile_face, gutter_free
from farfield_worker.compile.pack import GUTTER
from farfield_worker.compile.quads import layer_quads
from farfield_worker.render import Renderer, open_renderer


class LayeredImpostors:
    """Makes layer quads."""

    def __init__(self, scene: PreparedScene, walk: Walk, settings: BakeSettings) -> None:
        self.walk = walk
        self._faces = face_axes.SIDES if settings.faces == "sides" else face_axes.ALL
        self._renderer: Renderer = open_renderer(settings.renderer, scene, settings.supersample)
        self.name = self._renderer.name
        self._half = np.array(walk.grid.size) / 2
        self._rules = Rules(
            walk.layers,
            walk.resolution,
            settings.grower,
            gutter_free(min(walk.atlas.width, walk.atlas.height), GUTTER),
            settings.gap_fill == "steep",
        )
        # One more layer inside the near field tells gap filling where surfaces come nearer still.
        inner = placement.place(
            settings.half_extents,
            walk.resolution,
            len(walk.layers) + 1,
            settings.alpha,
            settings.gap_texels,
        ).near_field
        self._borders = (*walk.borders, inner)
        self._sight = Sight(scene, walk, settings) if settings.visibility == "on" else None

    def make(self, centre: NDArray[np.float64], watch: Stopwatch) -> Impostors:
        """Impostors of the cell around `centre` (3,), scene coordinates."""
        resolution, layers = self.walk.resolution, self.walk.layers
        drawn, compiled = {}, {}
        for face in self._faces:
            with watch("render"):
                texels = self._renderer.face(centre, face, self._borders, resolution)
                if (texels.layer < len(layers)).any():
                    drawn[face] = texels
        seen = None
        if self._sight is not None:
            with watch("visibility"):
                seen = self._sight.seen(centre, drawn)
        for face, texels in drawn.items():
            with watch("compile"):
                half = self._face_half(face)
                mask = None if seen is None else seen[face]
                compiled[face] = compile_face(texels, self._rules, half, mask)
        with watch("compile"):
            size = (self.walk.atlas.width, self.walk.atlas.height)
            boxes, places, pages = lay_out(compiled, resolution, size)
            quads = layer_quads(boxes, places, layers)
        return Impostors((triple(centre),), quads, pages, texel_figures(compiled))

    def close(self) -> None:
        """Free what the renderer holds."""
        self._renderer.close()
        if self._sight is not None:
            self._sight.close()

    def _face_half(self, face: int) -> tuple[float, float, float]:
        """Half extents of the cell along a face's right, down and forward."""
        _, right, down, forward = face_axes.FACES[face]
        across, along, depth = (float(np.abs(axis) @ self._half) for axis in (right, down, forward))
        return across, along, depth


def texel_figures(faces: dict[int, CompiledFace]) -> dict[str, float]:
    """Counts of texels at each stage, and how full the rectangles are."""
    stored = sum(len(face.texel) for face in faces.values())
    area = sum(int((face.boxes[:, 3] * face.boxes[:, 4]).sum()) for face in faces.values())
    return {
        "texels_rendered": sum(face.rendered for face in faces.values()),
        "texels_filled": sum(face.filled for face in faces.values()),
        "texels": stored,
        "fill": stored / area if area else 1.0,
    }
