"""Draws a walk's files pixel by pixel: slow, obvious, and sharing nothing with the viewer.

For each pixel a ray leaves the camera; every quad is met as a plane in space, every near triangle
by solving for its barycentric coordinates. The nearest hit wins, the first in order among equals.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core.faces import FACES
from farfield_shading import dither, shade, sky, to_linear, to_srgb
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]


def camera_rays(yaw: float, pitch: float, fov: float, size: tuple[int, int]) -> Floats:
    """Rays (height, width, 3) of length 1 along the view axis; yaw 0 looks along -z."""
    width, height = size
    tangent = math.tan(fov / 2)
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * tangent * width / height
    y = (1 - (np.arange(height) + 0.5) / height * 2) * tangent
    gx, gy = np.meshgrid(x, y)
    local = np.stack([gx, gy, -np.ones_like(gx)], axis=-1)
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    tilt = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    turn = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return np.asarray(local @ (turn @ tilt).T, np.float64)


class Picture:
    """RGBA picture with the inverse of every pixel's depth; alpha 0 is background."""

    def __init__(self, rays: Floats, eye: Floats) -> None:
        self.rays, self.eye = rays, eye
        self.color = np.zeros((*rays.shape[:2], 4), np.uint8)
        self.inverse = np.full(rays.shape[:2], -1.0)

    def put(self, where: NDArray[np.bool_], inverse: Floats, rgb: Floats) -> None:
        """Write `rgb` (..., 3) in 0..255 where nothing as near was written before."""
        # What is hit at one depth is drawn once: the first. Depth buffers tell 1e-7 apart.
        wins = where & (inverse > self.inverse + 1e-7)
        self.color[wins, :3] = np.clip(np.round(rgb[wins]), 0, 255).astype(np.uint8)
        self.color[wins, 3] = 255
        self.inverse[wins] = inverse[wins]


def draw_quads(picture: Picture, cell: dict[str, Any], walk: dict[str, Any], folder: Path) -> None:
    """All quads of a cell, in the order of the file."""
    resolution = walk["resolution"]
    pages = [np.asarray(Image.open(folder / "atlases" / name)) for name in cell["atlases"]]
    quads = cell["quads"]
    corner = 0
    for q, count in enumerate(quads["corner_counts"]):
        _, right, down, forward = FACES[quads["faces"][q]]
        a, b, c = quads["planes"][3 * q : 3 * q + 3]
        corners = np.array(quads["corners"][2 * corner : 2 * (corner + count)]).reshape(-1, 2)
        corner += count
        normal = a * right + b * down + c * forward
        offset = picture.eye - np.array(cell["eyes"][quads["eyes"][q]])
        along = picture.rays @ normal
        free = 1 - normal @ offset
        # The hit is eye + ray * free / along; scaled by along it also exists at infinity.
        hit = offset * along[..., None] + picture.rays * free
        z = hit @ forward
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, inverse = hit @ right / z, hit @ down / z, along / free
        x, y = (u + 1) * resolution / 2, (v + 1) * resolution / 2
        inside = (z > 0) & (inverse >= 0) & in_polygon(corners, x, y)
        if quads["turned"][q]:
            x, y = y, x
        page = pages[quads["pages"][q]]
        column = np.floor(quads["scales"][q] * x + quads["offsets"][2 * q])
        row = np.floor(quads["scales"][q] * y + quads["offsets"][2 * q + 1])
        inside &= (column >= 0) & (column < page.shape[1]) & (row >= 0) & (row < page.shape[0])
        texel = np.zeros((*x.shape, 4), np.float64)
        texel[inside] = page[row[inside].astype(int), column[inside].astype(int)]
        picture.put(inside & (texel[..., 3] >= 127.5), np.where(inside, inverse, 0), texel[..., :3])


def in_polygon(corners: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Whether (x, y) lie in a convex polygon, whichever way it turns."""
    sides = []
    for n, (px, py) in enumerate(corners):
        qx, qy = corners[(n + 1) % len(corners)]
        sides.append((qx - px) * (y - py) - (qy - py) * (x - px))
    stacked = np.array(sides)
    return np.asarray((stacked >= 0).all(axis=0) | (stacked <= 0).all(axis=0), np.bool_)


def draw_near(picture: Picture, cell: dict[str, Any], walk: dict[str, Any], folder: Path) -> None:
    """The near triangles that a cell lists, clipped to its near field."""
    for reference in cell["near"]:
        gltf, data = read_glb(folder / "near" / reference["blob"])
        node = gltf["nodes"][0]
        triples = np.array(reference["ranges"]).reshape(-1, 3)
        for number, first, count in triples:
            primitive = gltf["meshes"][0]["primitives"][number]
            values = {
                name: values_of(gltf, data, accessor)
                for name, accessor in primitive["attributes"].items()
            }
            positions = values["POSITION"] * np.array(node["scale"]) + np.array(node["translation"])
            triangles = values_of(gltf, data, primitive["indices"]).astype(int).reshape(-1, 3)
            material = gltf["materials"][primitive["material"]]
            for triangle in triangles[first : first + count]:
                draw_triangle(
                    picture, triangle, positions, values, material, gltf, walk, cell, folder
                )


def draw_triangle(
    picture: Picture,
    triangle: NDArray[np.int64],
    positions: Floats,
    values: dict[str, Floats],
    material: dict[str, Any],
    gltf: dict[str, Any],
    walk: dict[str, Any],
    cell: dict[str, Any],
    folder: Path,
) -> None:
    """One near triangle, shaded by the light model."""
    p = positions[triangle] - picture.eye
    normal = np.cross(p[1] - p[0], p[2] - p[0])
    volume = normal @ p[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = picture.rays @ normal / volume
        hit = picture.rays / inverse[..., None]
        area = normal @ normal
        weights = np.stack(
            [
                np.cross(p[(n + 2) % 3] - p[(n + 1) % 3], hit - p[(n + 1) % 3]) @ normal / area
                for n in range(3)
            ],
            axis=-1,
        )
    front = volume < 0
    if not front and not material.get("doubleSided", False):
        return
    local = hit + picture.eye - np.array(cell["eyes"][0])
    inside = (inverse > 0) & (weights >= 0).all(axis=-1)
    inside &= np.abs(local).max(axis=-1) <= walk["near_field"] * 17 / 16
    base = np.nan_to_num(weights @ values["COLOR_0"][triangle])
    texture = material.get("pbrMetallicRoughness", {}).get("baseColorTexture")
    if texture is not None:
        uv = np.nan_to_num(weights @ values["TEXCOORD_0"][triangle])
        image = gltf["images"][gltf["textures"][texture["index"]]["source"]]["uri"]
        base = base * sample(np.asarray(Image.open(folder / "near" / image)), uv)
    if material.get("alphaMode") == "MASK":
        inside &= base[..., 3] >= material["alphaCutoff"]
    if material.get("extras", {}).get("alpha") == "dither":
        rows, columns = np.indices(inside.shape)
        inside &= dither(base[..., 3], columns, rows)
    normals = weights @ values["NORMAL"][triangle][:, :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.nan_to_num(normals) * (1.0 if front else -1.0)
    emissive = np.array(material.get("emissiveFactor", [0.0, 0.0, 0.0]))
    unlit = "KHR_materials_unlit" in material.get("extensions", {})
    lit = shade(walk["light"], base[..., :3], normals, emissive, unlit)
    picture.put(inside, np.where(inside, inverse, 0), 255 * to_srgb(lit))


def sample(image: NDArray[np.uint8], uv: Floats) -> Floats:
    """Nearest texel, linear; u repeats and v is mirrored, as the fixture's sampler says."""
    height, width, _ = image.shape
    column = np.floor(np.mod(uv[..., 0], 1) * width).astype(int) % width
    mirrored = np.mod(uv[..., 1], 2)
    mirrored = np.where(mirrored > 1, 2 - mirrored, mirrored)
    row = np.minimum(np.floor(mirrored * height).astype(int), height - 1)
    texel = image[row, column] / 255.0
    texel[..., :3] = to_linear(texel[..., :3])
    return np.asarray(texel, np.float64)


def read_glb(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and binary part of a GLB."""
    raw = path.read_bytes()
    length = struct.unpack_from("<I", raw, 12)[0]
    return json.loads(raw[20 : 20 + length]), raw[28 + length :]


def values_of(gltf: dict[str, Any], data: bytes, index: int) -> Floats:
    """An accessor's values as float, normalised where it says so."""
    accessor = gltf["accessors"][index]
    view = gltf["bufferViews"][accessor["bufferView"]]
    kind = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
    dtype = np.dtype(kind[accessor["componentType"]])
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    stride = view.get("byteStride", dtype.itemsize * width)
    rows = np.ndarray(
        (accessor["count"], width), dtype, data, view["byteOffset"], (stride, dtype.itemsize)
    )
    scale = np.iinfo(dtype).max if accessor.get("normalized") else 1
    return np.asarray(rows / scale, np.float64)


def draw_walk(
    folder: Path,
    cell_name: str,
    eye: tuple[float, float, float],
    yaw: float,
    pitch: float,
    size: tuple[int, int],
) -> NDArray[np.uint8]:
    """RGBA picture (height, width, 4) of one cell from any eye, 60 degrees high, sky alpha 0."""
    walk = json.loads((folder / "walk.json").read_text())
    cell = json.loads((folder / "cells" / f"{cell_name}.json").read_text())
    picture = Picture(camera_rays(yaw, pitch, math.radians(60), size), np.array(eye))
    draw_near(picture, cell, walk, folder)
    draw_quads(picture, cell, walk, folder)
    background = np.round(255 * to_srgb(sky(walk["light"], picture.rays)))
    empty = picture.color[..., 3] == 0
    picture.color[empty, :3] = background[empty].astype(np.uint8)
    return picture.color
