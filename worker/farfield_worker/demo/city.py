"""The demo scene: a city in a lake, of 50 thousand to 10 million triangles.

    facts = write_city(Path("city.glb"), triangles=850_000)

The plan, the silhouettes and the share of every part of the city are the same whatever the number
of triangles; only how finely everything is worked out differs.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from farfield_core.errors import BadInputError
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.demo.glb import GlbWriter, Primitive
from farfield_worker.demo.land import EXTENT, land_tint
from farfield_worker.demo.lighting import HeightMap
from farfield_worker.demo.looks import Material
from farfield_worker.demo.parts import City, build, select
from farfield_worker.demo.surfaces import Kind, Surfaces
from farfield_worker.demo.tessellate import tessellate, unevenness
from farfield_worker.demo.textures import textures

TRIANGLES = 850_000
LEAST, MOST = 50_000, 10_000_000
#: districts along x and along z
DISTRICTS = 4
_CHUNK = 300_000  # vertices worked on at a time
_DOUBLE_SIDED = {Material.FOLIAGE, Material.CLOTH, Material.WOOD}


@dataclass(frozen=True)
class CityFacts:
    """What was written.

    Attributes:
        triangles: their number.
        vertices: their number.
        bounds: (2, 3) float, low and high corner, metres.
        parts: triangles of each part of the city.
        digest: content hash, see `CityHash`.
    """

    triangles: int
    vertices: int
    bounds: NDArray[np.float64]
    parts: dict[str, int]
    digest: str


class CityHash:
    """SHA-256 over the content, independent of how a file stores it: texels, then for every
    primitive in order positions, texture coordinates (in 1/65536), colours and triangles.
    """

    def __init__(self, images: dict[Material, NDArray[np.uint8]]) -> None:
        self._hash = hashlib.sha256()
        for material, image in images.items():
            self._hash.update(bytes([material]))
            self._hash.update(image.tobytes())

    def add(self, primitive: Primitive) -> None:
        """Take in one primitive."""
        self._hash.update(bytes([primitive.material]))
        for array in (
            np.rint(primitive.positions * 1024).astype("<i4"),
            np.rint(primitive.uvs.astype(np.float64) * 65536).astype("<i4"),
            primitive.colors,
            primitive.triangles.astype("<u4"),
        ):
            self._hash.update(array.tobytes())

    def digest(self) -> str:
        """First 32 hex digits."""
        return self._hash.hexdigest()[:32]


def write_city(path: Path, triangles: int = TRIANGLES) -> CityFacts:
    """Write the city as one GLB file; raises BadInputError for a number of triangles out of range.

    The file appears only when it is whole. The number written is within 2 % of the wish.
    """
    _check(triangles)
    with ThreadPoolExecutor(1) as beside:
        # mostly large arrays, which leave the interpreter to the other thread
        drawing = beside.submit(_pictures)
        parts, districts = _districts(triangles)
        images, pictures = drawing.result()
    writer = GlbWriter("Farfield demo city")
    for material in Material:
        writer.material(
            material.name.lower(),
            pictures.get(material),
            mask=material == Material.FOLIAGE,
            double_sided=material in _DOUBLE_SIDED,
        )
    digest = CityHash(images)
    total, vertices = 0, 0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for name, primitives in districts:
        collected = []
        for primitive in primitives:
            digest.add(primitive)
            total += len(primitive.triangles)
            vertices += len(primitive.positions)
            low = np.minimum(low, primitive.positions.min(axis=0))
            high = np.maximum(high, primitive.positions.max(axis=0))
            collected.append(primitive)
        writer.mesh(name, collected)
    writer.write(path)
    return CityFacts(total, vertices, np.stack([low, high]), parts, digest.digest())


def city_primitives(triangles: int = TRIANGLES) -> Iterator[Primitive]:
    """The city's meshes without writing a file."""
    for _, primitives in _districts(triangles)[1]:
        yield from primitives


def _check(triangles: int) -> None:
    if not LEAST <= triangles <= MOST:
        raise BadInputError(
            f"The demo city has between {LEAST:,} and {MOST:,} triangles, not {triangles:,}."
        )


def _pictures() -> tuple[dict[Material, NDArray[np.uint8]], dict[Material, bytes]]:
    """All textures, and the files that they become."""
    images = textures()
    return images, {material: _png(image, material) for material, image in images.items()}


@lru_cache(maxsize=1)
def _city() -> City:
    return build()


def _districts(
    triangles: int,
) -> tuple[dict[str, int], Iterator[tuple[str, Iterator[Primitive]]]]:
    _check(triangles)
    city = _city()
    table, nu, nv, counts = select(city, triangles)
    return counts, _walk_districts(city.map, table, nu, nv)


def _walk_districts(
    light: HeightMap, table: Surfaces, nu: NDArray[np.int64], nv: NDArray[np.int64]
) -> Iterator[tuple[str, Iterator[Primitive]]]:
    centres = table.centres()[:, [0, 2]]
    tile = np.floor((centres + EXTENT) / (2 * EXTENT) * DISTRICTS).astype(np.int64)
    tile = np.clip(tile, 0, DISTRICTS - 1)
    key = (tile[:, 1] * DISTRICTS + tile[:, 0]) * len(Material) + table.material
    order = np.argsort(key, kind="stable")
    for district in range(DISTRICTS * DISTRICTS):
        first, last = (district * len(Material), (district + 1) * len(Material))
        rows = order[np.searchsorted(key[order], first) : np.searchsorted(key[order], last)]
        if len(rows):
            groups = np.split(rows, np.flatnonzero(np.diff(key[rows])) + 1)
            name = f"district {district % DISTRICTS} {district // DISTRICTS}"
            yield name, (_primitive(light, table, nu, nv, group) for group in groups)


def _primitive(
    light: HeightMap,
    table: Surfaces,
    nu: NDArray[np.int64],
    nv: NDArray[np.int64],
    rows: NDArray[np.int64],
) -> Primitive:
    """All surfaces `rows`, which share a material, as one mesh."""
    vertices = (nu[rows] + 1) * (nv[rows] + 1)
    chunk = np.cumsum(vertices) // _CHUNK
    pieces = []
    offset = 0
    for group in np.split(rows, np.flatnonzero(np.diff(chunk)) + 1):
        part = table.take(group)
        mesh = tessellate(part, nu[group], nv[group])
        colors = _colors(light, part, mesh.row, mesh.positions, mesh.normals)
        pieces.append(
            (
                mesh.positions.astype(np.float32),
                mesh.normals.astype(np.float32),
                mesh.uvs.astype(np.float32),
                colors,
                mesh.triangles + np.uint32(offset),
            )
        )
        offset += len(mesh.positions)
    p, n, t, c, f = (np.concatenate(arrays) for arrays in zip(*pieces, strict=True))
    return Primitive(int(table.material[rows[0]]), p, n, t, c, f)


def _colors(
    light: HeightMap,
    table: Surfaces,
    row: NDArray[np.int64],
    positions: NDArray[np.float64],
    normals: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """Tint times a cloudy variation times baked light, (n, 4) uint8, linear."""
    color = table.tint[row].copy()
    land = np.flatnonzero(table.kind[row] == Kind.LAND)
    color[land] = land_tint(positions[land], normals[land, 1])
    water = np.flatnonzero(table.material[row] == Material.WATER)
    if len(water):
        color[water] = _water_tint(light, positions[water])
    other = np.flatnonzero(table.kind[row] != Kind.CARD)
    cloud = unevenness(positions[other] * 0.11)[:, 0] * 0.06
    color[other] *= (0.97 + cloud)[:, None]
    color[other] *= light.factors(positions[other], normals[other])
    out = np.full((len(row), 4), 255, np.uint8)
    out[:, :3] = np.clip(np.rint(color * 255), 0, 255).astype(np.uint8)
    return out


def _water_tint(light: HeightMap, p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Greener in canals and near the shore, streaked far out, (n, 3) float, linear."""
    near = light.wide.ravel()[light.metres(p[:, 0], p[:, 2])].astype(np.float64)
    shallow = np.clip(near / 0.9, 0, 1)[:, None]
    streaks = 0.84 + 0.16 * unevenness(p * 0.033)[:, :1]
    return np.asarray((1 - shallow) * streaks + shallow * np.array((0.62, 0.80, 0.66)))


def _png(image: NDArray[np.uint8], material: Material) -> bytes:
    buffer = io.BytesIO()
    pixels = image if material == Material.FOLIAGE else image[..., :3]
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, "PNG", compress_level=2)
    return buffer.getvalue()
