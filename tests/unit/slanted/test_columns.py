"""Slanted quads as columns of the walk format: order, mapping to pages, eyes."""

import numpy as np
import pytest
from farfield_core.scene import PreparedScene
from farfield_worker.cell.slanted import cell_figures, lay_out_images, quad_columns
from farfield_worker.slanted.baker import SlantedBaker, SlantedCell

from tests.unit.slanted.test_cell import RESOLUTION, SETTINGS, town


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> tuple[PreparedScene, SlantedCell]:
    scene = town(tmp_path_factory.mktemp("town") / "prepared")
    baker = SlantedBaker(scene, RESOLUTION)
    cell = baker.cell(scene.origin, SETTINGS)
    baker.close()
    return scene, cell


def test_columns_say_where_every_texel_lies(baked: tuple[PreparedScene, SlantedCell]) -> None:
    _, cell = baked
    images = [image for part in cell.parts for image in part.quads.images]
    places, pages = lay_out_images(images, (96, 80))
    eyes, quads = quad_columns(cell.parts, places, RESOLUTION)
    assert len(pages) > 1
    assert not eyes[0].any()
    assert len(np.unique(eyes, axis=0)) == len(eyes)
    assert set(quads.layers) == {-1}
    # quads of one eye and face find their sheets' pictures where the mapping says
    counts = np.array(quads.corner_counts)
    corners = np.split(np.array(quads.corners).reshape(-1, 2), np.cumsum(counts)[:-1])
    planes = np.array(quads.planes).reshape(-1, 3)
    offsets = np.array(quads.offsets).reshape(-1, 2)
    nearest = []
    seen: dict[tuple[int, int, bytes], int] = {}
    for q, polygon in enumerate(corners):
        u, v = (2 * polygon / RESOLUTION - 1).T
        nearest.append((planes[q, 0] * u + planes[q, 1] * v + planes[q, 2]).max())
        seen[quads.eyes[q], quads.faces[q], planes[q].tobytes() + polygon.tobytes()] = q
    assert np.all(np.diff(nearest) <= 1e-4 * np.abs(nearest[:-1]))
    assert len(seen) == len(corners) == sum(len(part.quads.sheet) for part in cell.parts)
    for part in cell.parts:
        eye = next(i for i, e in enumerate(eyes) if np.array_equal(e, part.eye))
        for sheet, polygon, plane in zip(
            part.quads.sheet, part.quads.polygons, part.quads.plane, strict=True
        ):
            q = seen[eye, part.face, plane.tobytes() + polygon.round(4).tobytes()]
            x0, y0, x1, y1 = part.quads.texels.rect[sheet]
            picture = part.quads.images[sheet]
            assert quads.turned[q] == (y1 - y0 > x1 - x0)
            if quads.turned[q]:
                x0, y0, x1, y1 = y0, x0, y1, x1
                picture = picture.transpose(1, 0, 2)
            left, top = (offsets[q] + np.array([x0, y0])).astype(int)
            page = pages[quads.pages[q], top - 1 : top + y1 - y0 + 1, left - 1 : left + x1 - x0 + 1]
            drawn = picture[..., 3] > 0
            assert np.array_equal(page[1:-1, 1:-1][drawn], picture[drawn])
            # the quad is a little larger than its picture: the gutter repeats its edge, alpha too
            edge = np.pad(picture[..., 3], 1, mode="edge")
            assert np.array_equal(page[..., 3], edge)


def test_figures(baked: tuple[PreparedScene, SlantedCell]) -> None:
    _, cell = baked
    figures = cell_figures(cell)
    pictures = [image for part in cell.parts for image in part.quads.images]
    assert figures["texels"] == sum(int((image[..., 3] > 0).sum()) for image in pictures)
    assert figures["fill"] == pytest.approx(
        figures["texels"] / sum(image.shape[0] * image.shape[1] for image in pictures)
    )
    assert 0 < figures["texels_filled"] < figures["texels"]
    assert figures["fragments_seen"] < figures["fragments"]
    assert figures["residual_quads"] > 0
