"""One view cell as slanted quads: A-buffer, visibility, sheets, quads, residual quads.

Its inputs are numbers and a scene, its output quads with their pictures; packing, encoding and the
cell file are those of the layer bake.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field

import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.slanted.abuffer import ABuffer
from farfield_worker.slanted.fragments import Fragments
from farfield_worker.slanted.near_border import walls
from farfield_worker.slanted.painter import QuadPainter
from farfield_worker.slanted.planes import seeds
from farfield_worker.slanted.quads import face_quads, texel_points
from farfield_worker.slanted.residual import EyeQuads, corners, residual_quads
from farfield_worker.slanted.segment import SegmentSettings
from farfield_worker.slanted.tolerance import DEFAULT_FACTOR, Tolerance
from farfield_worker.visibility.clusters import Clusters
from farfield_worker.visibility.depth_maps import DepthMapRenderer, MapCache
from farfield_worker.visibility.far_texels import FarTexels
from farfield_worker.visibility.from_region import cell_eyes, seen
from farfield_worker.visibility.sampling import Watcher
from farfield_worker.visibility.spread import spread

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: times the block run in its context, under a name
Watch = Callable[[str], AbstractContextManager[None]]
#: shows what the cell's eyes see to the watchers given
Look = Callable[[Sequence[Watcher]], None]


@dataclass(frozen=True)
class SlantedSettings:
    """What a slanted bake may be asked for.

    Attributes:
        half_extents: (3,) half the cell's edge lengths, metres.
        near: half width of the near field, metres.
        alpha: parallax bound, radians.
        resolution: texels across a face.
        tolerance: share of the bound that sheets use.
        faces: faces to bake.
        visibility: whether to leave out what no eye in the cell can see.
        spread: texels by which what is seen is taken further along its surface.
        residual: whether to add quads of the cell's corners.
        segment: knobs of the segmentation.
    """

    half_extents: tuple[float, float, float]
    near: float
    alpha: float
    resolution: int
    tolerance: float = DEFAULT_FACTOR
    faces: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    visibility: bool = True
    spread: int = 1
    residual: bool = True
    segment: SegmentSettings = field(default_factory=SegmentSettings)


@dataclass
class SlantedCell:
    """The quads of a cell and how they came about.

    Attributes:
        parts: quads by eye and face, eyes relative to the cell's centre; the centre's come first.
        fragments, seen: fragments in all A-buffers, and of those the ones that some eye can see.
    """

    parts: list[EyeQuads]
    fragments: int
    seen: int


class SlantedBaker:
    """Bakes cells of one scene. Create it in the process that uses it, never before a fork."""

    def __init__(self, scene: PreparedScene, resolution: int, cache: int = 160) -> None:
        self.scene = scene
        self.resolution = resolution
        clusters = Clusters(scene)
        self._abuffer = ABuffer(scene, clusters)
        self.renderer = DepthMapRenderer(scene, resolution, clusters)
        self.maps = MapCache(self.renderer, cache)
        self._painter = QuadPainter(resolution)

    def cell(
        self,
        centre: Sequence[float] | Floats,
        settings: SlantedSettings,
        watch: Watch | None = None,
        look: Look | None = None,
    ) -> SlantedCell:
        """Quads of the cell around `centre` (3,), scene coordinates.

        `watch` times the stages; `look`, if given, tells what the cell's eyes see instead of depth
        maps of the whole scene.
        """
        stage = watch or (lambda kind: nullcontext())
        c = np.asarray(centre, np.float64)
        cell = SlantedCell([], 0, 0)
        with stage("render"):
            fragments = {
                face: self._abuffer.fragments(c, face, settings.near, self.resolution)
                for face in settings.faces
            }
        cell.fragments = sum(len(f.texel) for f in fragments.values())
        known: dict[int, Mask] = {}
        if settings.visibility:
            with stage("visibility"):
                fragments, known = self._visible(c, fragments, settings, look)
        cell.seen = sum(len(f.texel) for f in fragments.values())
        self._painter.clear()
        with stage("sheets"):
            for face, here in fragments.items():
                if len(here.texel):
                    part = self._centre_quads(c, face, here, settings, known.get(face))
                    cell.parts.append(part)
                    self._painter.add(part.face, part.eye, part.quads)
        if settings.residual:
            with stage("residual"):
                cell.parts += self._residuals(c, settings)
        return cell

    def close(self) -> None:
        """Free what the GPU holds."""
        for thing in (self._abuffer, self.renderer, self._painter):
            thing.close()

    def _tolerance(self, face: int, settings: SlantedSettings) -> Tolerance:
        return Tolerance.of(
            face,
            np.zeros(3),
            settings.half_extents,
            settings.alpha,
            settings.near,
            settings.tolerance,
        )

    def _visible(
        self,
        centre: Floats,
        fragments: dict[int, Fragments],
        settings: SlantedSettings,
        look: Look | None,
    ) -> tuple[dict[int, Fragments], dict[int, Mask]]:
        """Fragments that some eye of the cell can see and what continues them; which are seen."""
        places, slack = [], []
        for face, here in fragments.items():
            places.append(texel_points(face, here.texel, here.disparity, self.resolution))
            high = self._tolerance(face, settings).interval(here.disparity)[1]
            slack.append(high - here.disparity)
        points = np.concatenate(places)
        points += centre
        if look is None:
            eyes = cell_eyes(centre, np.asarray(settings.half_extents))
            known = seen(points, np.concatenate(slack), eyes, self.maps)
        else:
            disparity = np.concatenate([here.disparity for here in fragments.values()])
            far = FarTexels(points, np.concatenate(slack) / disparity)
            look([far])
            known = far.seen
        ends = np.cumsum([len(f.texel) for f in fragments.values()])
        visible, core = {}, {}
        for (face, here), mask in zip(fragments.items(), np.split(known, ends[:-1]), strict=True):
            wider = spread(
                here.texel,
                here.disparity,
                mask,
                self._tolerance(face, settings),
                self.resolution,
                settings.spread,
            )
            visible[face], core[face] = here.take(wider), mask[wider]
        return visible, core

    def _residuals(self, centre: Floats, settings: SlantedSettings) -> list[EyeQuads]:
        """Quads of the cell's corners; what the painter holds is what there is so far."""
        half = np.asarray(settings.half_extents, np.float64)
        return residual_quads(
            self.scene,
            self.renderer,
            self.maps,
            self._painter,
            centre,
            half,
            corners(centre, half),
            settings.faces,
            settings.alpha,
            settings.near,
            settings.tolerance,
            settings.segment,
        )

    def _centre_quads(
        self,
        centre: Floats,
        face: int,
        fragments: Fragments,
        settings: SlantedSettings,
        known: Mask | None,
    ) -> EyeQuads:
        seed, planes = seeds(self.scene, centre, face, fragments.triangle)
        quads = face_quads(
            fragments,
            seed,
            planes,
            self._tolerance(face, settings),
            walls(face, np.zeros(3), settings.near),
            self.resolution,
            settings.segment,
            seen=known,
        )
        return EyeQuads(np.zeros(3), face, quads)
