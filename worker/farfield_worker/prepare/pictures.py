"""Two pictures of a prepared scene: a map seen from straight above and a thumbnail."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from farfield_core.scene import MapView, PreparedScene
from farfield_shading import to_linear, to_srgb
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.prepare.camera import Camera, look_at_box, top_view
from farfield_worker.prepare.draw import Painter

#: longest side of the map, pixels
MAP_SIZE = 1024
THUMBNAIL = (512, 384)
#: pixels drawn for one kept, per side
_SUPERSAMPLE = 2


@dataclass(frozen=True)
class _Box:
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def draw_pictures(scene: PreparedScene, folder: Path) -> MapView | None:
    """Write map.png and thumbnail.png into `folder`; None where there is no OpenGL."""
    painter = Painter.create(scene)
    if painter is None:
        return None
    try:
        low, high = (np.array(side) for side in (scene.info.bounds.min, scene.info.bounds.max))
        camera, rectangle, size = top_view(low - scene.origin, high - scene.origin, MAP_SIZE)
        _picture(painter, camera, size, sky=False).save(folder / "map.png")
        box = crowd(scene)
        portrait = look_at_box(box.low, box.high, THUMBNAIL[0] / THUMBNAIL[1])
        _picture(painter, portrait, THUMBNAIL, sky=True).convert("RGB").save(
            folder / "thumbnail.png"
        )
    finally:
        painter.close()
    corner = scene.origin[[0, 2]]
    return MapView(
        file="map.png",
        width=size[0],
        height=size[1],
        min=_pair(rectangle[0] + corner),
        max=_pair(rectangle[1] + corner),
    )


def crowd(scene: PreparedScene) -> _Box:
    """Box around what most triangles belong to: a stray piece far off must not shrink the rest."""
    blocks = scene.info.blocks
    weight = np.array([block.triangles for block in blocks], np.float64)
    low = np.array([block.low for block in blocks])
    high = np.array([block.high for block in blocks])
    return _Box(_quantile(low, weight, 0.02), _quantile(high, weight, 0.98))


def _quantile(
    values: NDArray[np.float64], weight: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    out = np.empty(3)
    for axis in range(3):
        order = np.argsort(values[:, axis])
        running = np.cumsum(weight[order])
        out[axis] = values[order[np.searchsorted(running, share * running[-1])], axis]
    return out


def _picture(painter: Painter, camera: Camera, size: tuple[int, int], sky: bool) -> Image.Image:
    width, height = size
    big = painter.draw(camera, width * _SUPERSAMPLE, height * _SUPERSAMPLE, sky)
    out = np.empty((height, width, 4), np.uint8)
    for row in range(height):
        strip = big[row * _SUPERSAMPLE : (row + 1) * _SUPERSAMPLE] / 255
        pixels = strip.reshape(_SUPERSAMPLE, width, _SUPERSAMPLE, 4)
        alpha = pixels[..., 3:]
        light = (to_linear(pixels[..., :3]) * alpha).mean(axis=(0, 2))
        cover = alpha.mean(axis=(0, 2))
        color = to_srgb(light / np.where(cover > 0, cover, 1))
        out[row] = np.rint(np.concatenate([color, cover], -1) * 255)
    return Image.fromarray(out)


def _pair(point: NDArray[np.float64]) -> tuple[float, float]:
    return float(point[0]), float(point[1])
