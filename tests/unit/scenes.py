"""Prepared scenes made by hand, for tests: triangles in, a folder in core/scene.py's format out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from farfield_core.scene import (
    Batch,
    Block,
    Bounds,
    Part,
    PreparedScene,
    SceneInfo,
    Texture,
    open_scene,
)
from numpy.typing import ArrayLike, NDArray
from PIL import Image

#: corners and triangles of the unit cube, counter-clockwise from outside
_CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
_SIDES = np.array(
    [[4, 6, 7, 5], [0, 1, 3, 2], [2, 3, 7, 6], [0, 4, 5, 1], [1, 5, 7, 3], [0, 2, 6, 4]]
)


class SceneWriter:
    """Collects triangles and writes them as a prepared scene."""

    def __init__(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        self.origin = np.asarray(origin, np.float64)
        self.batches: list[Batch] = []
        self._textures: list[tuple[Texture, NDArray[np.uint8]]] = []
        self._pieces: list[dict[str, Any]] = []

    def texture(self, pixels: ArrayLike, **options: Any) -> int:
        """Add an image, (h, w, 4) uint8; returns its number."""
        image = np.asarray(pixels, np.uint8)
        name = f"{len(self._textures)}.png"
        texture = Texture(file=name, width=image.shape[1], height=image.shape[0], **options)
        self._textures.append((texture, image))
        return len(self._textures) - 1

    def batch(self, **options: Any) -> int:
        """Add a batch with `Batch`'s options; returns its number."""
        self.batches.append(Batch(**options))
        return len(self.batches) - 1

    def triangles(
        self,
        batch: int,
        corners: ArrayLike,
        color: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        uvs: ArrayLike | None = None,
        normals: ArrayLike | None = None,
    ) -> None:
        """Add triangles: `corners` (n, 3, 3) in scene coordinates, `color` linear, one for all or
        (n, 3, 4), `uvs` (n, 3, 2), `normals` (n, 3, 3) or flat ones.
        """
        p = np.asarray(corners, np.float64).reshape(-1, 3, 3)
        if normals is None:
            n = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
            n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-30)
            normals = np.repeat(n[:, None], 3, axis=1)
        self._pieces.append(
            {
                "batch": np.full(len(p), batch),
                "positions": p - self.origin,
                "normals": np.broadcast_to(np.asarray(normals, np.float64), p.shape),
                "uvs": np.zeros((len(p), 3, 2))
                if uvs is None
                else np.asarray(uvs).reshape(-1, 3, 2),
                "colors": np.broadcast_to(np.asarray(color, np.float64), (len(p), 3, 4)),
            }
        )

    def quad(self, batch: int, corners: ArrayLike, **options: Any) -> None:
        """Add a rectangle, `corners` (4, 3) counter-clockwise from its front; u runs from the
        first to the second corner, v from the last to the first (up the picture).
        """
        p = np.asarray(corners, np.float64)
        uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]) * options.pop("tiles", 1.0)
        order = np.array([[0, 1, 2], [0, 2, 3]])
        self.triangles(batch, p[order], uvs=uv[order], **options)

    def box(self, batch: int, low: ArrayLike, high: ArrayLike, **options: Any) -> None:
        """Add a box seen from outside."""
        corners = np.asarray(low) + _CUBE * (np.asarray(high, np.float64) - np.asarray(low))
        for side in _SIDES:
            self.quad(batch, corners[side], **options)

    def write(self, folder: Path, block_triangles: int = 64) -> PreparedScene:
        """Write the scene into `folder` in blocks of at most `block_triangles` and open it."""
        whole = {
            key: np.concatenate([piece[key] for piece in self._pieces]) for key in self._pieces[0]
        }
        centres = whole["positions"].mean(axis=1)
        extent = max(float(np.ptp(centres, axis=0).max()), 1e-9)
        cells = np.floor((centres - centres.min(axis=0)) / extent * 4).astype(np.int64)
        order = np.lexsort((cells[:, 1], cells[:, 2], cells[:, 0]))
        blocks: list[Block] = []
        taken: list[NDArray[np.int64]] = []
        for start in range(0, len(order), block_triangles):
            rows = order[start : start + block_triangles]
            rows = rows[np.argsort(whole["batch"][rows], kind="stable")]
            numbers, counts = np.unique(whole["batch"][rows], return_counts=True)
            firsts = start + np.cumsum(counts) - counts
            corners = whole["positions"][rows].astype(np.float32).reshape(-1, 3)
            blocks.append(
                Block(
                    low=tuple(corners.min(axis=0).tolist()),
                    high=tuple(corners.max(axis=0).tolist()),
                    first_vertex=3 * start,
                    vertices=3 * len(rows),
                    parts=tuple(
                        Part(batch=int(b), first_triangle=int(f), triangles=int(c))
                        for b, f, c in zip(numbers, firsts, counts, strict=True)
                    ),
                )
            )
            taken.append(rows)
        rows = np.concatenate(taken)
        return self._save(folder, blocks, {key: value[rows] for key, value in whole.items()})

    def _save(
        self, folder: Path, blocks: list[Block], whole: dict[str, NDArray[np.float64]]
    ) -> PreparedScene:
        (folder / "textures").mkdir(parents=True)
        for texture, image in self._textures:
            Image.fromarray(image, "RGBA").save(folder / "textures" / texture.file)
        positions = whole["positions"].astype(np.float32).reshape(-1, 3)
        normals = np.zeros((len(positions), 4), np.int8)
        normals[:, :3] = np.rint(whole["normals"].reshape(-1, 3) * 127)
        arrays = {
            "positions": positions,
            "normals": normals,
            "uvs": whole["uvs"].astype(np.float32).reshape(-1, 2),
            "colors": np.rint(whole["colors"].reshape(-1, 4) * 65535).astype(np.uint16),
            "triangles": np.arange(len(positions), dtype=np.uint32).reshape(-1, 3),
        }
        for name, array in arrays.items():
            np.save(folder / f"{name}.npy", array)
        low, high = positions.min(axis=0) + self.origin, positions.max(axis=0) + self.origin
        info = SceneInfo(
            id="test",
            name="test",
            bounds=Bounds(min=tuple(low.tolist()), max=tuple(high.tolist())),
            origin=tuple(self.origin.tolist()),
            triangles=len(arrays["triangles"]),
            vertices=len(positions),
            textures=tuple(texture for texture, _ in self._textures),
            batches=tuple(self.batches),
            blocks=tuple(blocks),
        )
        (folder / "scene.json").write_text(info.model_dump_json(), encoding="utf-8")
        return open_scene(folder)


def checkerboard(size: int = 16, alpha: tuple[int, int] = (255, 255)) -> NDArray[np.uint8]:
    """An image of coloured squares whose alternate squares have the two `alpha` values."""
    y, x = np.mgrid[:size, :size]
    odd = (x // 4 + y // 4) % 2
    channels = [np.where(odd, 230, 40), x * 255 // size, y * 255 // size, np.where(odd, *alpha)]
    return np.stack(channels, axis=-1).astype(np.uint8)


def random_scene(
    folder: Path, seed: int, triangles: int = 400, origin: ArrayLike = (0.0, 0.0, 0.0)
) -> PreparedScene:
    """A scene of everything at once: all kinds of materials, slivers, a huge floor,
    boxes at whole metres and walls that contain the origin, all around the scene's origin.
    """
    rng = np.random.default_rng(seed)
    writer = SceneWriter(origin)
    picture = writer.texture(checkerboard())
    holes = writer.texture(checkerboard(alpha=(255, 0)), wrap_u="mirror", wrap_v="clamp")
    blocky = writer.texture(checkerboard(8), filter="nearest")
    batches = [
        writer.batch(),
        writer.batch(double_sided=True, emissive=(0.1, 0.0, 0.2)),
        writer.batch(texture=picture, unlit=True),
        writer.batch(texture=holes, alpha="mask", cutoff=0.4, double_sided=True),
        writer.batch(alpha="dither", double_sided=True),
        writer.batch(texture=blocky, emissive=(1.0, 1.0, 1.0), emissive_texture=picture),
    ]

    def scatter(n: int, size: float, thin: float) -> NDArray[np.float64]:
        distance = np.exp(rng.uniform(np.log(4.0), np.log(400.0), (n, 1)))
        direction = rng.normal(size=(n, 3))
        direction /= np.abs(direction).max(axis=1, keepdims=True)
        corners = (direction * distance)[:, None] + rng.normal(size=(n, 3, 3)) * size * (
            distance[:, None]
        )
        corners[:, 2] += (corners[:, 1] - corners[:, 2]) * (1.0 - thin)
        return corners

    for n, batch in enumerate(batches):
        color = rng.uniform(0.2, 1.0, 4)
        some = triangles // len(batches)
        for size, thin in ((0.02, 1.0), (0.3, 1.0), (0.5, 1e-4), (0.5, 1e-7)):
            corners = scatter(max(some // 4, 1), size, thin)
            uvs = rng.uniform(-2.0, 3.0, (len(corners), 3, 2))
            writer.triangles(batch, corners + writer.origin, color=color, uvs=uvs)
        low = np.rint(scatter(1, 0.0, 1.0)[0, 0])
        writer.box(batch, writer.origin + low, writer.origin + low + 2 ** (n % 4), color=color)
    o = writer.origin
    floor = np.array([[-900, -3, 900], [900, -3, 900], [900, -3, -900], [-900, -3, -900]])
    writer.quad(batches[0], o + floor, color=(0.3, 0.5, 0.2, 1.0))
    # walls that contain the origin: edge-on for an eye there
    wall = np.array([[0, -5, 300], [0, -5, 5], [0, 9, 5], [0, 9, 300]])
    writer.quad(batches[1], o + wall)
    turn = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    writer.quad(batches[1], o + wall @ turn)
    return writer.write(folder)
