"""Compiled faces as atlas pages: order, pack, copy the texels, continue colours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from farfield_worker.compile.dilate import dilate
from farfield_worker.compile.layered import CompiledFace
from farfield_worker.compile.pack import Places, pack
from farfield_worker.compile.quads import Rectangles


def lay_out(
    faces: Mapping[int, CompiledFace], resolution: int, page_size: tuple[int, int]
) -> tuple[Rectangles, Places, NDArray[np.uint8]]:
    """Rectangles front to back, their places, and the pages, (p, height, width, 4) uint8.

    `faces` are keyed by face number; `page_size` is (width, height).
    """
    columns = [
        np.concatenate(
            [np.full((len(face.boxes), 1), number, np.int32), face.boxes], axis=1, dtype=np.int32
        )
        for number, face in faces.items()
    ]
    table = np.concatenate([np.empty((0, 6), np.int32), *columns])
    boxes = Rectangles(*(np.ascontiguousarray(column) for column in table.T))
    order = boxes.front_to_back()
    rank = np.empty(len(order), np.intp)
    rank[order] = np.arange(len(order))
    boxes = boxes.take(order)
    width, height = page_size
    places = pack(boxes.width, boxes.height, width, height)
    pages = np.zeros((int(places.page.max(initial=-1)) + 1, height, width), np.uint32)
    first = 0
    for face in faces.values():
        at = rank[first + face.owner]
        row, column = np.divmod(face.texel, resolution)
        y = places.y[at] + row - boxes.y[at]
        x = places.x[at] + column - boxes.x[at]
        pages[places.page[at], y, x] = face.color
        first += len(face.boxes)
    dilate(pages, places.page, places.x, places.y, boxes.width, boxes.height)
    return boxes, places, pages.view(np.uint8).reshape(len(pages), height, width, 4)
