"""A tiny walk with nothing rendered: a painted room around a few cells, its quads computed exactly.

The room is a box seen from inside, so every side is a plane of affine disparity on every face, and
there is geometry in all directions: a pixel of background is a fault. Boards with holes stand in
the room, one of them recorded from an eye in a cell's corner, one infinitely far behind a window.
Near geometry exercises every draw state of a near block.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core.faces import FACES, directions
from farfield_shading import default_light
from numpy.typing import NDArray
from PIL import Image

from tests.browser.near_block import near_block

Floats = NDArray[np.float64]

SIZE = np.array([8.0, 4.0, 8.0])
NEAR = 10.0
RESOLUTION = 64
PAGE = 128
ROOM_LOW = np.array([-60.0, -20.0, -50.0])
ROOM_HIGH = np.array([80.0, 40.0, 70.0])
CELLS = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1), (1, 0, 1), (2, 0, 1)]
#: listed in walk.json, but its file does not exist
UNBAKED = (3, 0, 1)
#: a window in the far wall, through which the infinitely far is seen
WINDOW = (-10.0, 10.0, 0.0, 12.0)

Painter = Callable[[Floats, Floats], NDArray[np.uint8]]


@dataclass
class Page:
    """An atlas page being filled shelf by shelf."""

    pixels: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((PAGE, PAGE, 4), np.uint8))
    x: int = 0
    y: int = 0
    shelf: int = 0

    def place(self, width: int, height: int) -> tuple[int, int] | None:
        """Room for `width` x `height` texels, gutter included, or None."""
        if self.x + width > PAGE:
            self.x, self.y, self.shelf = 0, self.y + self.shelf, 0
        if self.y + height > PAGE or width > PAGE:
            return None
        spot = (self.x, self.y)
        self.x += width
        self.shelf = max(self.shelf, height)
        return spot


class CellWriter:
    """Collects one cell's quads and pages."""

    def __init__(self, index: tuple[int, int, int]) -> None:
        self.index = index
        self.low = np.array(index) * SIZE
        self.eyes = [self.low + SIZE / 2, self.low + SIZE]
        self.pages = [Page()]
        self.quads: list[tuple[float, dict[str, Any]]] = []

    def quad(
        self,
        face: int,
        polygon: Floats,
        plane: Floats,
        paint: Painter,
        *,
        eye: int = 0,
        scale: float = 1.0,
        turned: bool = False,
    ) -> None:
        """Add one quad; `polygon` (n, 2) in (u, v), `paint` gives RGBA at arrays of u and v."""
        corners = (polygon + 1) * RESOLUTION / 2
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int), RESOLUTION)
        shape = np.ceil((high - low) * scale).astype(int) + 2
        width, height = (shape[1], shape[0]) if turned else (shape[0], shape[1])
        spot = self.pages[-1].place(width, height)
        if spot is None:
            self.pages.append(Page())
            spot = self.pages[-1].place(width, height)
            assert spot is not None
        column, row = np.meshgrid(np.arange(width) - 0.5, np.arange(height) - 0.5)
        if turned:
            column, row = row, column
        x, y = low[0] + column / scale, low[1] + row / scale
        colors = paint(2 * x / RESOLUTION - 1, 2 * y / RESOLUTION - 1)
        self.pages[-1].pixels[spot[1] : spot[1] + height, spot[0] : spot[0] + width] = colors
        start = (low[1], low[0]) if turned else (low[0], low[1])
        nearest = max(plane @ np.array([u, v, 1.0]) for u, v in polygon)
        self.quads.append(
            (
                nearest,
                {
                    "eyes": [eye],
                    "faces": [face],
                    "layers": [-1],
                    "corner_counts": [len(polygon)],
                    "corners": corners.ravel().tolist(),
                    "planes": plane.tolist(),
                    "pages": [len(self.pages) - 1],
                    "scales": [scale],
                    "offsets": [spot[0] + 1 - scale * start[0], spot[1] + 1 - scale * start[1]],
                    "turned": [int(turned)],
                },
            )
        )

    def columns(self) -> dict[str, list[Any]]:
        """The quad columns of the cell's file, front to back."""
        columns: dict[str, list[Any]] = {name: [] for name in self.quads[0][1]}
        for _, quad in sorted(self.quads, key=lambda item: -item[0]):
            for name, values in quad.items():
                columns[name].extend(values)
        return columns


def wall_color(points: Floats) -> NDArray[np.uint8]:
    """Colour of the room's walls at (..., 3) points: tiles of 5 m, each side with its own tint."""
    tiles = np.floor(points / 5.0 + 1e-3).sum(axis=-1).astype(int) & 1
    tint = (points - ROOM_LOW) / (ROOM_HIGH - ROOM_LOW)
    color = 40 + 150 * np.clip(tint, 0, 1) + 40 * tiles[..., None]
    alpha = np.full((*color.shape[:-1], 1), 255.0)
    return np.concatenate([color, alpha], axis=-1).astype(np.uint8)


def in_window(points: Floats) -> NDArray[np.bool_]:
    """Whether points of the far wall lie in its window."""
    x0, x1, y0, y1 = WINDOW
    x, y, z = np.moveaxis(points, -1, 0)
    inside = (x > x0) & (x < x1) & (y > y0) & (y < y1)
    return inside & (np.abs(z - ROOM_LOW[2]) < 0.01)


def clip(polygon: Floats, half_plane: Floats) -> Floats:
    """The part of a convex polygon (n, 2) where half_plane @ (u, v, 1) >= 0.

    This is Sutherland and Hodgman's clipping.
    """
    kept: list[Floats] = []
    values = [float(half_plane @ np.array([*p, 1.0])) for p in polygon]
    for n, (p, value) in enumerate(zip(polygon, values, strict=True)):
        other, beyond = polygon[n - 1], values[n - 1]
        if (value >= 0) != (beyond >= 0):
            kept.append(other + (p - other) * (beyond / (beyond - value)))
        if value >= 0:
            kept.append(p)
    return np.array(kept).reshape(-1, 2)


def add_walls(cell: CellWriter) -> None:
    """Every side of the room on every face: where its disparity is the greatest of all sides."""
    eye = cell.eyes[0]
    sides = []
    for axis in range(3):
        for limit in (ROOM_LOW[axis], ROOM_HIGH[axis]):
            normal = np.zeros(3)
            normal[axis] = 1.0 / (limit - eye[axis])
            sides.append(normal)
    for number, (_, right, down, forward) in enumerate(FACES):
        planes = [np.array([n @ right, n @ down, n @ forward]) for n in sides]
        for n, plane in enumerate(planes):
            polygon = np.array([[-1.0, -1.0], [1, -1], [1, 1], [-1, 1]])
            for other in planes[:n] + planes[n + 1 :]:
                if len(polygon) > 0:
                    polygon = clip(polygon, plane - other)
            if len(polygon) < 3 or np.ptp(polygon, axis=0).min() < 1e-6:
                continue

            def paint(
                u: Floats, v: Floats, number: int = number, plane: Floats = plane
            ) -> NDArray[np.uint8]:
                d = np.maximum(plane[0] * u + plane[1] * v + plane[2], 1e-6)
                points = eye + directions(number, u, v) / d[..., None]
                color = wall_color(points)
                color[..., 3] = np.where(in_window(points), 0, 255)
                return color

            cell.quad(number, polygon, plane, paint, turned=n % 2 == 1)


def add_boards(cell: CellWriter) -> None:
    """A board with round holes, one seen from the cell's corner, and the sky behind the window."""

    def holes(u: Floats, v: Floats) -> NDArray[np.uint8]:
        color = np.zeros((*u.shape, 4), np.uint8)
        color[..., :3] = (230, 190, 60)
        hole = (np.mod(u * 12, 1) - 0.5) ** 2 + (np.mod(v * 12, 1) - 0.5) ** 2 < 0.09
        color[..., 3] = np.where(hole, 0, 255)
        return color

    def plain(u: Floats, v: Floats) -> NDArray[np.uint8]:
        color = np.full((*u.shape, 4), 255, np.uint8)
        color[..., 0] = 200
        color[..., 1] = np.clip(120 + 100 * v, 0, 255)
        color[..., 2] = 70
        return color

    square = np.array([[-0.5, -0.375], [0.25, -0.375], [0.25, 0.25], [-0.5, 0.25]])
    for eye, distance, paint, face, scale in (
        (0, 30.0, holes, 0, 1.0),
        (1, 25.0, holes, 4, 1.0),
        (0, 22.0, plain, 1, 0.5),
    ):
        # The board from another eye stands at the same place for all cells of a column.
        plane = np.array([0.1 / distance, 0.0, 1.0 / distance])
        cell.quad(face, square, plane, paint, eye=eye, scale=scale)
    everything = np.array([[-1.0, -1.0], [1, -1], [1, 1], [-1, 1]])
    cell.quad(5, everything, np.zeros(3), plain, scale=0.5)


def sha(data: bytes) -> str:
    """A blob's name."""
    return hashlib.sha256(data).hexdigest()[:32]


def write_blob(folder: Path, data: bytes, suffix: str) -> str:
    """Write `data` under its hash; return the name."""
    folder.mkdir(parents=True, exist_ok=True)
    name = sha(data) + suffix
    (folder / name).write_bytes(data)
    return name


def write_png(folder: Path, pixels: NDArray[np.uint8]) -> str:
    """Write an image under the hash of its file; return the name."""
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / "page.tmp"
    Image.fromarray(pixels).save(temporary, format="PNG")
    data = temporary.read_bytes()
    temporary.unlink()
    return write_blob(folder, data, ".png")


def write_room(folder: Path, *, smooth: bool = False) -> Path:
    """Write the walk into `folder`, near textures squares or smooth; return walk.json's path."""
    near_folder = folder / "near"
    blob, triangles = near_block(lambda data, suffix: write_blob(near_folder, data, suffix), smooth)
    ranges = [value for n, count in enumerate(triangles) for value in (n, 0, count)]
    for index in CELLS:
        cell = CellWriter(index)
        add_walls(cell)
        add_boards(cell)
        text = {
            "format": "farfield-cell",
            "version": 1,
            "cell": list(index),
            "eyes": [eye.tolist() for eye in cell.eyes],
            "quads": cell.columns(),
            "atlases": [write_png(folder / "atlases", page.pixels) for page in cell.pages],
            "near": [{"blob": blob, "ranges": ranges}],
            "figures": {},
        }
        (folder / "cells").mkdir(exist_ok=True)
        name = "_".join(map(str, index)) + ".json"
        (folder / "cells" / name).write_text(json.dumps(text))
    listed = [*CELLS, UNBAKED]
    walk = {
        "format": "farfield-walk",
        "version": 1,
        "id": "room",
        "name": "The painted room",
        "scene": {
            "id": "room",
            "name": "The painted room",
            "triangles": 12,
            "bounds": {"min": ROOM_LOW.tolist(), "max": ROOM_HIGH.tolist()},
        },
        "settings": {},
        "resolution": RESOLUTION,
        "layers": [],
        "borders": [],
        "near_field": NEAR,
        "grid": {
            "origin": [0.0, 0.0, 0.0],
            "size": SIZE.tolist(),
            "total": len(listed),
            "cells": {
                "i": [i for i, _, _ in listed],
                "j": [j for _, j, _ in listed],
                "k": [k for _, _, k in listed],
                "y": [j * SIZE[1] for _, j, _ in listed],
            },
            "pages": [],
        },
        "atlas": {"width": PAGE, "height": PAGE, "encoding": "png"},
        "light": default_light(),
        "places": {"cells": "cells/", "atlases": "atlases/", "near": "near/"},
        "start": {"eye": [4.0, 2.0, 4.0], "yaw": 0.0, "pitch": 0.0},
    }
    path = folder / "walk.json"
    path.write_text(json.dumps(walk))
    return path
