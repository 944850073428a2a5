"""From the fragments that one face of one eye shows to its quads: the slanted bake's middle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from farfield_core.faces import FACES, texel_centres
from numba import njit
from numpy.typing import NDArray

from farfield_worker.slanted.absorb import absorb
from farfield_worker.slanted.clip import (
    clip_to_range,
    disparity_range,
    grown_rectangles,
    untouched,
)
from farfield_worker.slanted.colours import shown
from farfield_worker.slanted.fill import SheetTexels, fill
from farfield_worker.slanted.fragments import Fragments
from farfield_worker.slanted.grid import texel_starts
from farfield_worker.slanted.near_border import inside, split
from farfield_worker.slanted.planes import TrianglePlanes
from farfield_worker.slanted.segment import SegmentSettings, Sheets, segment
from farfield_worker.slanted.tolerance import Tolerance

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: corners that the format allows a quad
MOST_CORNERS = 8
#: how finely corners are written, in texels (cell/slanted.py)
ROUNDED = 1e-4


class SlantedQuads(NamedTuple):
    """Quads of one face of one eye, and the sheets whose texels they show.

    Attributes:
        sheet: (q,) int32, the sheet of each quad; several quads may show one.
        polygons: q arrays (k, 2) float, texels, convex, 3 <= k <= 8.
        plane: (q, 3) float, a, b, c of the disparity plane.
        texel, disparity: (n,) int32, (n,) float, the fragments they were made from.
        sheets: the sheets as segmented.
        texels: what each sheet draws.
        images: one (h, w, 4) uint8 picture per sheet, its rectangle `texels.rect`; sRGB, alpha 0
            or 255.
    """

    sheet: Ints
    polygons: list[Floats]
    plane: Floats
    texel: Ints
    disparity: Floats
    sheets: Sheets
    texels: SheetTexels
    images: list[NDArray[np.uint8]]


def face_quads(
    fragments: Fragments,
    seed: Ints,
    triangles: TrianglePlanes,
    tolerance: Tolerance,
    walls: Floats,
    resolution: int,
    settings: SegmentSettings | None = None,
    least: int = 1,
    seen: NDArray[np.bool_] | None = None,
) -> SlantedQuads:
    """Quads that draw `fragments`; `seed` (n,) is the row of `triangles` that each shows.

    `walls` (m, 3) are those of the near border (`near_border.walls`). Sheets that capture fewer
    than `least` texels are dropped. Fragments not `seen` (n,) may show their neighbours' colours.
    """
    disparity = fragments.disparity.astype(np.float64)
    u, v = texel_uv(fragments.texel, resolution)
    far = ~inside(disparity, u, v, walls)
    low, high = tolerance.interval(disparity[far])
    sheets = segment(
        fragments.texel[far],
        disparity[far],
        low,
        high,
        seed[far],
        triangles.plane,
        resolution,
        settings,
    )
    # what lies in the near field is captured by none but may fill
    owner = np.full(len(disparity), -1, np.int32)
    owner[far] = sheets.owner
    sheets = sheets._replace(owner=owner)
    if least > 1:
        sheets = _drop(sheets, least)
    low2, high2 = tolerance.interval(disparity, 2.0)
    starts = texel_starts(fragments.texel, resolution)
    sheets = absorb(sheets, fragments.texel, starts, disparity, low2, high2, resolution)
    texels = fill(sheets, starts, disparity, low2, high2, resolution)
    known = np.ones(len(disparity), np.bool_) if seen is None else seen
    source = shown(sheets, texels, known, resolution)
    farthest, nearest = disparity_range(texels, disparity, seed, triangles, tolerance, resolution)
    # a corner on d = 0 must not end up behind the eye once it is rounded
    farthest = np.maximum(
        farthest, ROUNDED * np.abs(sheets.plane[:, :2]).sum(axis=1) * 2 / resolution
    )
    dips = _dips(sheets, u, v, walls)
    sheet, polygons, planes = [], [], []
    rectangles = grown_rectangles(texels.rect)
    whole = untouched(rectangles, sheets.plane, farthest, nearest, walls, resolution)
    for s, plane in enumerate(sheets.plane):
        if whole[s]:
            sheet.append(s)
            polygons.append(rectangles[s])
            planes.append(plane)
            continue
        clipped = clip_to_range(rectangles[s], plane, farthest[s], nearest[s], resolution)
        if len(clipped) < 3:
            continue
        for part, part_plane in split(clipped, plane, walls, resolution, cut=not dips[s]):
            for polygon in limit_corners(part):
                sheet.append(s)
                polygons.append(polygon)
                planes.append(part_plane)
    return SlantedQuads(
        np.array(sheet, np.int32),
        polygons,
        np.array(planes).reshape(-1, 3),
        fragments.texel,
        disparity,
        sheets,
        texels,
        sheet_images(texels, fragments.color[source], resolution),
    )


def _dips(sheets: Sheets, u: Floats, v: Floats, walls: Floats) -> NDArray[np.bool_]:
    """Sheets that draw a captured fragment, seen at (u, v) (n,), (n,), in the near field: (s,)."""
    dips = np.zeros(len(sheets.rect), np.bool_)
    captured = np.flatnonzero(sheets.owner >= 0)
    owner = sheets.owner[captured]
    a, b, c = sheets.plane[owner].T
    within = inside(a * u[captured] + b * v[captured] + c, u[captured], v[captured], walls)
    dips[owner[within]] = True
    return dips


def texel_uv(texel: Ints, resolution: int) -> tuple[Floats, Floats]:
    """Face coordinates of the centres of `texel` (n,): (n,), (n,) float."""
    centres = texel_centres(resolution)
    return centres[texel % resolution], centres[texel // resolution]


def texel_points(
    face: int, texel: Ints, disparity: NDArray[np.floating], resolution: int
) -> Floats:
    """Points seen at `texel` (n,) of `face` with `disparity` (n,), relative to the eye: (n, 3)."""
    axes = FACES[face]
    points = np.empty((len(texel), 3))
    frame = np.stack([axes.right, axes.down, axes.forward]).astype(np.float64)
    _points(texel, disparity, frame, resolution, points)
    return points


@njit(cache=True)
def _points(texel: Any, disparity: Any, axes: Any, resolution: int, points: Any) -> None:
    size = 2.0 / resolution
    for i in range(len(texel)):
        u = (texel[i] % resolution + 0.5) * size - 1.0
        v = (texel[i] // resolution + 0.5) * size - 1.0
        for a in range(3):
            points[i, a] = (axes[2, a] + u * axes[0, a] + v * axes[1, a]) / disparity[i]


def sheet_images(
    texels: SheetTexels, color: NDArray[np.uint32], resolution: int
) -> list[NDArray[np.uint8]]:
    """One picture per sheet of its rectangle: (h, w, 4) uint8; `color` (m,) is its texels'."""
    images = []
    for s, (x0, y0, x1, y1) in enumerate(texels.rect):
        part = slice(texels.starts[s], texels.starts[s + 1])
        picture = np.zeros((y1 - y0, x1 - x0), np.uint32)
        texel = texels.texel[part]
        picture[texel // resolution - y0, texel % resolution - x0] = color[part]
        images.append(picture.view(np.uint8).reshape(y1 - y0, x1 - x0, 4))
    return images


def limit_corners(polygon: Floats) -> list[Floats]:
    """Cut a convex `polygon` (k, 2) into parts of at most MOST_CORNERS corners."""
    if len(polygon) <= MOST_CORNERS:
        return [polygon]
    half = len(polygon) // 2
    return [
        *limit_corners(polygon[: half + 1]),
        *limit_corners(np.vstack([polygon[half:], polygon[:1]])),
    ]


def _drop(sheets: Sheets, least: int) -> Sheets:
    """Sheets that own at least `least` fragments."""
    size = np.bincount(sheets.owner[sheets.owner >= 0], minlength=len(sheets.rect))
    return sheets.take(size >= least)
