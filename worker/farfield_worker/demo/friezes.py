"""Painted bands for temples and palaces: four rows of patterns that repeat along u."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.hashing import uniform
from farfield_worker.demo.looks import Rgb, rgb

Image = NDArray[np.uint8]

SIZE = 512
ROWS = 4
#: v of the top and bottom of each row, inside its margin
BANDS = tuple(((r + 0.04) / ROWS, (r + 0.96) / ROWS) for r in range(ROWS))
STEPPED_FRET, DISKS, SKULLS, STRIPES = range(ROWS)

_FRET = (
    "################",
    "#..............#",
    "#.############.#",
    "#.#..........#.#",
    "#.#.########.#.#",
    "#.#.#......#.#.#",
    "#.#.#.####.#.#.#",
    "#.#.#.#..#.#.#.#",
    "#.#.#.##.#.#.#.#",
    "#.#.#....#.#.#.#",
    "#.#.######.#.#.#",
    "#.#........#.#.#",
    "#.##########.#.#",
    "#............#.#",
    "##############.#",
    "...............#",
)
_SKULL = (
    "................",
    "....#######.....",
    "...#########....",
    "..###########...",
    "..###########...",
    "..#...###...#...",
    "..#...###...#...",
    "..#...###...#...",
    "..#####.#####...",
    "...###...###....",
    "....#######.....",
    "....#.#.#.#.....",
    "....#.#.#.#.....",
    "....#######.....",
    "................",
    "................",
)


def _sprite(rows: tuple[str, ...], on: Rgb, off: Rgb) -> NDArray[np.float64]:
    mask = np.array([[c == "#" for c in row] for row in rows])
    return np.where(mask[..., None], np.array(on), np.array(off))


def friezes() -> Image:
    """The texture, (512, 512, 4) uint8."""
    height = SIZE // ROWS
    tiles = [
        _sprite(_FRET, rgb("f2e3c0"), rgb("a8382a")),
        _disks(),
        _sprite(_SKULL, rgb("f4ead6"), rgb("8c2a22")),
        _stripes(),
    ]
    bands = []
    for tile in tiles:
        scale = height // tile.shape[0]
        big = np.repeat(np.repeat(tile, scale, axis=0), scale, axis=1)
        bands.append(np.tile(big, (1, SIZE // big.shape[1], 1)))
    color = np.concatenate(bands)
    i, j = np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij")
    wear = 0.86 + 0.14 * uniform(42, i // 2, j // 2)
    wear = wear * (0.9 + 0.1 * uniform(43, i // 16, j // 16))
    out = np.full((SIZE, SIZE, 4), 255, np.uint8)
    out[..., :3] = np.rint(np.clip(color * wear[..., None], 0, 1) * 255).astype(np.uint8)
    return out


def _disks() -> NDArray[np.float64]:
    """Rings between two lines."""
    n = 64
    y, x = np.meshgrid(np.arange(n) + 0.5 - n / 2, np.arange(n) + 0.5 - n / 2, indexing="ij")
    d = np.sqrt(x * x + y * y)
    color = np.empty((n, n, 3))
    color[:] = rgb("2f8a88")
    color[np.abs(y) > 26] = rgb("f2e3c0")
    color[d < 20] = rgb("f2e3c0")
    color[d < 14] = rgb("c8872c")
    color[d < 6] = rgb("7c2a20")
    return color


def _stripes() -> NDArray[np.float64]:
    """Upright bars, the rain of Tlaloc."""
    color = np.empty((32, 32, 3))
    color[:] = rgb("f0ead8")
    color[:, 4:14] = rgb("3767a0")
    color[:, 20:30] = rgb("3767a0")
    color[:4] = rgb("2c4f7c")
    color[28:] = rgb("2c4f7c")
    return color
