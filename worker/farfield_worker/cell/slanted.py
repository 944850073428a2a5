"""The slanted bake of one cell: `slanted.baker`'s quads as columns and pages of the walk format."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from farfield_core import faces as face_axes
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import Quads, Walk
from numpy.typing import NDArray

from farfield_worker.cell.impostors import Impostors, Look, Stopwatch, triple
from farfield_worker.compile.dilate import dilate
from farfield_worker.compile.pack import GUTTER, Places, pack
from farfield_worker.gl import context as gl
from farfield_worker.slanted.baker import SlantedBaker, SlantedCell, SlantedSettings
from farfield_worker.slanted.residual import EyeQuads
from farfield_worker.slanted.segment import SegmentSettings

#: bytes of depth maps kept for neighbouring cells
_CACHE = 256 << 20


class SlantedImpostors:
    """Makes slanted quads."""

    def __init__(self, scene: PreparedScene, walk: Walk, settings: BakeSettings) -> None:
        self.walk = walk
        self._baker = SlantedBaker(
            scene, walk.resolution, max(8, _CACHE // (8 * walk.resolution**2))
        )
        with gl.current() as context:
            self.name = gl.device_name(context)
        # the ring of filled texels adds one on each side
        largest = min(walk.atlas.width, walk.atlas.height) - 2 * GUTTER - 2
        x, y, z = (float(s) / 2 for s in walk.grid.size)
        self._settings = SlantedSettings(
            half_extents=(x, y, z),
            near=walk.near_field,
            alpha=settings.parallax,
            resolution=walk.resolution,
            tolerance=settings.tolerance,
            faces=face_axes.SIDES if settings.faces == "sides" else face_axes.ALL,
            visibility=settings.visibility != "off",
            segment=SegmentSettings(largest=largest),
        )

    def make(
        self, centre: NDArray[np.float64], watch: Stopwatch, look: Look | None = None
    ) -> Impostors:
        """Impostors of the cell around `centre` (3,), scene coordinates."""
        cell = self._baker.cell(centre, self._settings, watch, look)
        with watch("compile"):
            size = (self.walk.atlas.width, self.walk.atlas.height)
            images = [image for part in cell.parts for image in part.quads.images]
            places, pages = lay_out_images(images, size)
            eyes, quads = quad_columns(cell.parts, places, self.walk.resolution)
        offsets = [triple(centre + eye) for eye in eyes]
        return Impostors(tuple(offsets), quads, pages, cell_figures(cell))

    def close(self) -> None:
        """Free what the GPU holds."""
        self._baker.close()


def lay_out_images(
    images: Sequence[NDArray[np.uint8]], page_size: tuple[int, int]
) -> tuple[Places, NDArray[np.uint8]]:
    """Places of `images`, each (h, w, 4) uint8, and the pages, (p, height, width, 4) uint8.

    `page_size` is (width, height). Colours go on under transparent texels and in the gutters,
    where alpha goes on too: quads are a little larger than their pictures. Pictures lie down.
    """
    images = [image.transpose(1, 0, 2) if turned(image) else image for image in images]
    height = np.array([image.shape[0] for image in images], np.int32)
    width = np.array([image.shape[1] for image in images], np.int32)
    places = pack(width, height, *page_size)
    shape = (int(places.page.max(initial=-1)) + 1, page_size[1], page_size[0])
    pages = np.zeros(shape, np.uint32)
    for image, page, x, y in zip(images, *places, strict=True):
        h, w = image.shape[:2]
        pages[page, y : y + h, x : x + w] = np.ascontiguousarray(image).view(np.uint32)[..., 0]
    dilate(pages, places.page, places.x, places.y, width, height)
    return places, pages.view(np.uint8).reshape(*shape, 4)


def turned(image: NDArray[np.uint8]) -> bool:
    """Whether a picture (h, w, 4) lies on its side on its page, so that rows are long."""
    return bool(image.shape[0] > image.shape[1])


def quad_columns(
    parts: Sequence[EyeQuads], places: Places, resolution: int
) -> tuple[list[NDArray[np.float64]], Quads]:
    """Eyes relative to the centre, which comes first, and all quads by column, front to back.

    `places` are those of the pictures of all `parts` in turn.
    """
    eyes: list[NDArray[np.float64]] = [np.zeros(3)]
    rows = []
    first = 0
    for part in parts:
        number = next((i for i, eye in enumerate(eyes) if np.array_equal(eye, part.eye)), len(eyes))
        if number == len(eyes):
            eyes.append(part.eye)
        quads = part.quads
        for sheet, polygon, plane in zip(quads.sheet, quads.polygons, quads.plane, strict=True):
            a, b, c = plane.tolist()
            u, v = (2 * polygon / resolution - 1).T
            nearest = float((a * u + b * v + c).max())
            x0, y0 = quads.texels.rect[sheet, :2].tolist()
            place = first + int(sheet)
            turn = turned(quads.images[sheet])
            if turn:
                x0, y0 = y0, x0
            offset = (float(places.x[place] - x0), float(places.y[place] - y0))
            page = int(places.page[place])
            rows.append((-nearest, number, part.face, polygon, (a, b, c), page, offset, turn))
        first += len(quads.images)
    rows.sort(key=lambda row: row[0])
    return eyes, Quads(
        eyes=tuple(row[1] for row in rows),
        faces=tuple(row[2] for row in rows),
        layers=(-1,) * len(rows),
        corner_counts=tuple(len(row[3]) for row in rows),
        corners=tuple(c for row in rows for c in row[3].ravel().round(4).tolist()),
        planes=tuple(c for row in rows for c in row[4]),
        pages=tuple(row[5] for row in rows),
        scales=(1.0,) * len(rows),
        offsets=tuple(c for row in rows for c in row[6]),
        turned=tuple(int(row[7]) for row in rows),
    )


def cell_figures(cell: SlantedCell) -> dict[str, float]:
    """Counts of fragments, texels and quads."""
    texels = [part.quads.texels for part in cell.parts]
    stored = sum(len(t.texel) for t in texels)
    area = sum(int(np.prod(t.rect[:, 2:] - t.rect[:, :2], axis=1).sum()) for t in texels)
    residual = [part.quads for part in cell.parts if part.eye.any()]
    return {
        "fragments": cell.fragments,
        "fragments_seen": cell.seen,
        "texels": stored,
        "texels_filled": sum(int(t.filled.sum()) for t in texels),
        "fill": stored / area if area else 1.0,
        "residual_quads": sum(len(quads.sheet) for quads in residual),
    }
