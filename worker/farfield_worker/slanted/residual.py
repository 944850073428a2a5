"""Residual quads: what other eyes of the cell see and the quads so far do not show.

Surfaces that the centre sees edge-on have few texels there, or none. From a corner of the cell they
are seen well. So for one corner after the other the quads so far are held against a full picture
from there, and what is missing is cut into quads of that corner's own faces, by the same code.
Missing is a texel of the far field that

- shows nothing, though it and its eight neighbours all lie on geometry, or
- shows something farther than anything true in its 3 x 3 neighbourhood by more than the tolerance.

Single stray texels are edges sampled differently, so at least three in a neighbourhood count; what
is left is dilated by one texel, which laps it over its surroundings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from farfield_core.scene import PreparedScene
from numpy.typing import NDArray

from farfield_worker.slanted.fragments import Fragments
from farfield_worker.slanted.near_border import inside, walls
from farfield_worker.slanted.painter import QuadPainter
from farfield_worker.slanted.planes import seeds
from farfield_worker.slanted.quads import SlantedQuads, face_quads, texel_uv
from farfield_worker.slanted.segment import SegmentSettings
from farfield_worker.slanted.tolerance import Tolerance
from farfield_worker.visibility.depth_maps import DepthMap, MapSource

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: residual texels needed in a 3 x 3 neighbourhood
CROWD = 3
#: texels that a residual sheet needs
LEAST = 4


class EyeQuads(NamedTuple):
    """Quads of one face of one eye of a cell: `eye` (3,) is relative to its centre."""

    eye: Floats
    face: int
    quads: SlantedQuads


def residual_texels(
    truth: DepthMap, shown: NDArray[np.float32], tolerance: Tolerance, far: Mask
) -> Mask:
    """Texels of a map (h, w) at which the far field is missing from what is `shown`.

    `shown` (h, w) is the disparity drawn, 0 where nothing is; `far` says where the truth shows the
    far field.
    """
    empty = (shown == 0) & (_least(truth.disparity) > 0)
    low = np.where(truth.disparity > 0, tolerance.interval(truth.disparity)[0], 0.0)
    beyond = (shown > 0) & (shown < _least(low))
    missing = far & (empty | beyond)
    return _grow(missing & (_crowd(missing) >= CROWD))


def residual_quads(
    scene: PreparedScene,
    maps: MapSource,
    painter: QuadPainter,
    centre: Floats,
    half_extents: Floats,
    eyes: Floats,
    faces: tuple[int, ...],
    alpha: float,
    near: float,
    factor: float,
    settings: SegmentSettings | None = None,
) -> list[EyeQuads]:
    """Quads that mend what `painter` leaves out as seen from `eyes` (k, 3), relative to `centre`.

    `painter` holds the quads so far and gets the new ones.
    """
    found = []
    for eye in eyes:
        new = []
        for face in faces:
            truth = maps.map(centre + eye, face)
            tolerance = Tolerance.of(face, eye, half_extents, alpha, near, factor)
            wall_planes = walls(face, eye, near)
            far = far_texels(truth, face, eye, near)
            shown, _ = painter.draw(face, eye)
            missing = residual_texels(truth, shown, tolerance, far)
            if not missing.any():
                continue
            fragments = map_fragments(truth, missing)
            seed, planes = seeds(scene, centre + eye, face, fragments.triangle)
            quads = face_quads(
                fragments,
                seed,
                planes,
                tolerance,
                wall_planes,
                len(shown),
                settings,
                least=LEAST,
            )
            if len(quads.sheet):
                new.append(EyeQuads(eye, face, quads))
        for part in new:
            painter.add(part.face, part.eye, part.quads)
        found.extend(new)
    return found


def far_texels(truth: DepthMap, face: int, eye: Floats, near: float) -> Mask:
    """Where a map of `face` of `eye` (3,), relative to the centre, shows the far field: (h, w)."""
    resolution = len(truth.disparity)
    every = np.arange(resolution * resolution, dtype=np.int32)
    u, v = texel_uv(every, resolution)
    within = inside(truth.disparity.reshape(-1), u, v, walls(face, eye, near))
    return (truth.disparity > 0) & ~within.reshape(resolution, resolution)


def map_fragments(truth: DepthMap, which: Mask) -> Fragments:
    """Texels of a map where `which` (h, w), as fragments; those without a surface are left out."""
    texel = np.flatnonzero(which & (truth.disparity > 0)).astype(np.int32)
    return Fragments(
        texel,
        truth.disparity.reshape(-1)[texel],
        truth.color.reshape(-1)[texel],
        truth.triangle.reshape(-1)[texel],
    )


def _around(values: NDArray[np.generic]) -> list[NDArray[np.generic]]:
    """The nine arrays of neighbours of `values` (h, w); edges are continued."""
    grown = np.pad(values, 1, mode="edge")
    h, w = values.shape
    return [grown[i : i + h, j : j + w] for i in range(3) for j in range(3)]


def _least(values: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(np.minimum.reduce(_around(values)))


def _crowd(mask: Mask) -> NDArray[np.uint8]:
    return np.asarray(np.add.reduce(_around(mask.astype(np.uint8))))


def _grow(mask: Mask) -> Mask:
    return np.asarray(np.logical_or.reduce(_around(mask)))
