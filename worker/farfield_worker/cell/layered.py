"""The layer bake of one cell (LEMI sections 3 to 5): render every layer, compile, lay out.

Between gap filling and cutting into rectangles, texels are left out that no eye in the cell can
see (visibility/far_texels.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from farfield_core import faces as face_axes
from farfield_core import placement
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import Walk
from numpy.typing import NDArray

from farfield_worker.cell.impostors import Impostors, Look, Stopwatch, triple
from farfield_worker.compile.atlas import lay_out
from farfield_worker.compile.layered import (
    CompiledFace,
    Rules,
    ShownFace,
    cut,
    gutter_free,
    shown_texels,
)
from farfield_worker.compile.pack import GUTTER
from farfield_worker.compile.quads import layer_quads
from farfield_worker.render import Renderer, open_renderer
from farfield_worker.visibility.far_texels import FarTexels

#: layers in front of a texel's own that never hide it (visibility/far_texels.py)
APART = 2


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

    def make(
        self, centre: NDArray[np.float64], watch: Stopwatch, look: Look | None = None
    ) -> Impostors:
        """Impostors of the cell around `centre` (3,), scene coordinates."""
        resolution, layers = self.walk.resolution, self.walk.layers
        faces: dict[int, ShownFace] = {}
        for face in self._faces:
            with watch("render"):
                texels = self._renderer.face(centre, face, self._borders, resolution)
            with watch("compile"):
                if (texels.layer < len(layers)).any():
                    faces[face] = shown_texels(texels, self._rules, self._face_half(face))
        worth = sum(len(shown.texel) for shown in faces.values())
        if look is not None:
            with watch("visibility"):
                faces = self._seen(centre, faces, look)
        with watch("compile"):
            compiled = {face: cut(shown, self._rules) for face, shown in faces.items()}
            size = (self.walk.atlas.width, self.walk.atlas.height)
            boxes, places, pages = lay_out(compiled, resolution, size)
            quads = layer_quads(boxes, places, layers)
        figures = {"texels_unhidden": worth, **texel_figures(compiled)}
        return Impostors((triple(centre),), quads, pages, figures)

    def close(self) -> None:
        """Free what the renderer holds."""
        self._renderer.close()

    def _seen(
        self, centre: NDArray[np.float64], faces: dict[int, ShownFace], look: Look
    ) -> dict[int, ShownFace]:
        """Texels that some eye in the cell can see; faces that show none are left out."""
        if not faces:
            look([])
            return {}
        points = [
            centre + texel_points(face, shown.texel, self.walk.layers, shown.layer, self._rules)
            for face, shown in faces.items()
        ]
        layer = np.concatenate([shown.layer for shown in faces.values()])
        far = FarTexels(np.concatenate(points), self._slack()[layer])
        look([far])
        ends = np.cumsum([len(shown.texel) for shown in faces.values()])
        masks = np.split(far.seen, ends[:-1])
        return {
            face: shown.take(mask)
            for (face, shown), mask in zip(faces.items(), masks, strict=True)
            if mask.any()
        }

    def _slack(self) -> NDArray[np.float64]:
        """By how much of a layer's disparity those in front may exceed it and hide nothing: (N,).

        The greatest ratio that two layers' disparities have for any eye in the cell.
        """
        layers, last = np.array(self.walk.layers), self.walk.near_field
        inner = last - (layers[-1] - last) * np.arange(APART)
        ahead = np.concatenate([layers, inner])[APART:]
        reach = float(self._half.max())
        return np.asarray((layers - reach) / np.maximum(ahead - reach, 1e-9) - 1)

    def _face_half(self, face: int) -> tuple[float, float, float]:
        """Half extents of the cell along a face's right, down and forward."""
        _, right, down, forward = face_axes.FACES[face]
        across, along, depth = (float(np.abs(axis) @ self._half) for axis in (right, down, forward))
        return across, along, depth


def texel_points(
    face: int,
    texel: NDArray[np.int32],
    distances: Sequence[float],
    layer: NDArray[np.int16],
    rules: Rules,
) -> NDArray[np.float64]:
    """Where texels (n,) of layers (n,) lie, relative to the cell's centre: (n, 3) float."""
    centres = face_axes.texel_centres(rules.resolution)
    u, v = centres[texel % rules.resolution], centres[texel // rules.resolution]
    z = np.asarray(distances, np.float64)[layer]
    return np.asarray(face_axes.directions(face, u, v) * z[:, None], np.float64)


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
