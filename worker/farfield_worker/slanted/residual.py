"""Residual quads: what other eyes of the cell see and the quads so far do not show.

Surfaces that the centre sees edge-on have few texels there, or none. From a corner of the cell they
are seen well. So for one corner after the other the quads so far are held against a full picture
from there, and what is missing is cut into quads of that corner's own faces, by the same code.
Missing is a texel of the far field that

- shows nothing, though it and its eight neighbours all lie on geometry, or
- shows something farther than anything true in its 3 x 3 neighbourhood by more than the tolerance.

Single stray texels are edges sampled differently, so at least three in a neighbourhood count; what
is left is dilated by one texel, which laps it over its surroundings.

Corners of neighbouring cells are corners of one lattice. Each cell starts with the four at which
the lattice's steps add up to an even number: a tetrahedron, of which neighbours share two corners.
The other four follow only where the last one looked from still found much.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.fragments import Fragments
from farfield_worker.slanted.near_border import walls
from farfield_worker.slanted.painter import QuadPainter
from farfield_worker.slanted.planes import seeds
from farfield_worker.slanted.quads import SlantedQuads, face_quads
from farfield_worker.slanted.segment import SegmentSettings
from farfield_worker.slanted.tolerance import Tolerance, lowest
from farfield_worker.visibility.depth_maps import DepthMap, DepthMapRenderer, MapSource

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: residual texels needed in a 3 x 3 neighbourhood
CROWD = 3
#: texels that a residual sheet needs
LEAST = 4
#: eyes that are always looked from
FIRST = 4
#: share of an eye's far texels that must be missing for others to follow the first ones
MUCH = 0.05
#: relative difference of disparity between two rasterisers' idea of one surface
SAME = 1e-3


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
    missing = np.zeros(shown.shape, np.bool_)
    _find(truth.disparity, tolerance.steps(), shown, far, missing)
    result = np.zeros(shown.shape, np.bool_)
    _crowd(missing, result)
    return result


def corners(centre: Floats, half_extents: Floats) -> Floats:
    """Corners of the cell around `centre` (3,), relative to it, even ones first: (8, 3) float."""
    half = np.asarray(half_extents, np.float64)
    offsets = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half
    # any shift of the lattice will do if no corner lies where rounding turns
    steps = np.floor((centre + offsets) / (2 * half) + 0.318)
    odd = steps.sum(axis=1) % 2
    return np.asarray(offsets[np.argsort(odd, kind="stable")])


def residual_quads(
    scene: PreparedScene,
    renderer: DepthMapRenderer,
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

    The eyes are looked from in turn, those beyond the first FIRST only while there is need.

    `painter` holds the quads so far and gets the new ones; `maps` are those of `renderer`.
    """
    found = []
    share = 1.0
    for number, eye in enumerate(eyes):
        if number >= FIRST and share < MUCH:
            break
        new = []
        looked = absent = 0
        for face in faces:
            truth = maps.map(centre + eye, face)
            far = far_texels(truth, face, eye, near)
            if not far.any():
                continue
            tolerance = Tolerance.of(face, eye, half_extents, alpha, near, factor)
            wall_planes = walls(face, eye, near)
            shown = painter.draw(face, eye)
            missing = residual_texels(truth, shown, tolerance, far)
            looked, absent = looked + int(far.sum()), absent + int(missing.sum())
            if not missing.any():
                continue
            fragments = residual_fragments(renderer, centre + eye, face, truth, missing)
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
        share = absent / max(looked, 1)
        for part in new:
            painter.add(part.face, part.eye, part.quads)
        found.extend(new)
    return found


def far_texels(truth: DepthMap, face: int, eye: Floats, near: float) -> Mask:
    """Where a map of `face` of `eye` (3,), relative to the centre, shows the far field: (h, w)."""
    far = np.zeros(truth.disparity.shape, np.bool_)
    _outside(truth.disparity, walls(face, eye, near), far)
    return far


def residual_fragments(
    renderer: DepthMapRenderer, eye: Floats, face: int, truth: DepthMap, missing: Mask
) -> Fragments:
    """Texels of a map of `face` of `eye` (3,), scene coordinates, that are `missing` (h, w).

    Those at which GL's rasteriser has no surface as near as the map's are left out.
    """
    which = missing & (truth.disparity > 0)
    picture = renderer.picture(eye, face, np.unique(truth.triangle[which]))
    which &= picture.disparity >= (1.0 - SAME) * truth.disparity
    texel = np.flatnonzero(which).astype(np.int32)
    return Fragments(
        texel,
        picture.disparity.reshape(-1)[texel],
        picture.color.reshape(-1)[texel],
        picture.triangle.reshape(-1)[texel],
    )


@njit(cache=True)
def _outside(disparity: Any, wall_planes: Any, far: Any) -> None:
    """Mark texels whose surface lies outside the near cube, see near_border.py."""
    size = 2.0 / len(disparity)
    for y in range(len(disparity)):
        v = (y + 0.5) * size - 1.0
        for x in range(len(disparity)):
            d = disparity[y, x]
            if d == 0.0:
                continue
            u = (x + 0.5) * size - 1.0
            for k in range(len(wall_planes)):
                if d <= wall_planes[k, 0] * u + wall_planes[k, 1] * v + wall_planes[k, 2]:
                    far[y, x] = True
                    break


@njit(cache=True)
def _find(true: Any, steps: Any, shown: Any, far: Any, missing: Any) -> None:
    """Mark far texels that show nothing amid geometry, or something beyond all that is true."""
    height, width = true.shape
    for y in range(height):
        for x in range(width):
            if not far[y, x] or (shown[y, x] > 0 and shown[y, x] >= lowest(true[y, x], steps)):
                continue
            amid, least = True, np.inf
            for ny in range(max(y - 1, 0), min(y + 2, height)):
                for nx in range(max(x - 1, 0), min(x + 2, width)):
                    if true[ny, nx] > 0:
                        least = min(least, lowest(true[ny, nx], steps))
                    else:
                        amid = False
            missing[y, x] = amid and (shown[y, x] == 0 or shown[y, x] < least)


@njit(cache=True)
def _crowd(missing: Any, result: Any) -> None:
    """Mark the 3 x 3 neighbourhoods of missing texels with at least CROWD around them."""
    height, width = missing.shape
    for y in range(height):
        for x in range(width):
            if not missing[y, x]:
                continue
            count = 0
            for ny in range(y - 1, y + 2):
                for nx in range(x - 1, x + 2):
                    count += missing[min(max(ny, 0), height - 1), min(max(nx, 0), width - 1)]
            if count >= CROWD:
                result[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = True
