"""One object as plain triangles, and its colours where they are asked for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from farfield_core.scene import PreparedScene
from farfield_shading import to_linear
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]


class ObjectMesh(NamedTuple):
    """A prepared scene taken as one object.

    Attributes:
        corners: (m, 3, 3) float64, metres.
        vertices: (m, 3) int64, the scene's vertices.
        welded: (m, 3) int64, corners numbered by place.
        batch: (m,) int64.
        scene: where normals, colours and textures come from.
    """

    corners: Floats
    vertices: NDArray[np.int64]
    welded: NDArray[np.int64]
    batch: NDArray[np.int64]
    scene: PreparedScene


class Surface(NamedTuple):
    """The surface at n points: `color` (n, 3) linear, `normal` (n, 3) unit, `opaque` (n,) bool."""

    color: Floats
    normal: Floats
    opaque: NDArray[np.bool_]


def read_mesh(
    scene: PreparedScene, rows: NDArray[np.int64] | None = None, origin: Floats | None = None
) -> ObjectMesh:
    """Take a prepared scene, or its triangles `rows` (m,), as one object.

    Its coordinates are relative to `origin` (3,), scene coordinates.
    """
    shift = scene.origin if origin is None else scene.origin - origin
    if rows is None:
        rows = np.arange(len(scene.triangles))
    triangles = np.asarray(scene.triangles[rows], np.int64)
    parts = [part for block in scene.info.blocks for part in block.parts]
    starts = np.array([part.first_triangle for part in parts], np.int64)
    of_part = np.array([part.batch for part in parts], np.int64)
    points = scene.positions[triangles]
    _, places = np.unique(points.reshape(-1, 3), axis=0, return_inverse=True)
    return ObjectMesh(
        points.astype(np.float64) + shift,
        triangles,
        places.reshape(-1, 3),
        of_part[np.searchsorted(starts, rows, side="right") - 1],
        scene,
    )


def opaque_at(mesh: ObjectMesh, triangle: NDArray[np.int64], weights: Floats) -> NDArray[np.bool_]:
    """Where points of triangles are no holes of a mask, (n,); arguments as in `surface_at`."""
    masked = [n for n, batch in enumerate(mesh.scene.info.batches) if batch.alpha == "mask"]
    rows = np.flatnonzero(np.isin(mesh.batch[triangle], masked))
    out = np.ones(len(triangle), np.bool_)
    if len(rows):
        out[rows] = surface_at(mesh, triangle[rows], weights[rows]).opaque
    return out


def surface_at(mesh: ObjectMesh, triangle: NDArray[np.int64], weights: Floats) -> Surface:
    """The surface at points of triangles: `triangle` (n,), `weights` (n, 3) barycentric."""
    scene = mesh.scene
    vertices = mesh.vertices[triangle]
    normal = np.einsum("nc,nck->nk", weights, scene.normals[vertices][..., :3] / 127.0)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    edges = mesh.corners[triangle]
    flat = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    normal = np.where(length > 1e-6, normal / np.maximum(length, 1e-6), flat)
    base = np.einsum("nc,nck->nk", weights, scene.colors[vertices] / 65535.0)
    opaque = np.ones(len(triangle), np.bool_)
    if len(scene.uvs):
        uv = np.einsum("nc,nck->nk", weights, scene.uvs[vertices].astype(np.float64))
    for number, batch in enumerate(scene.info.batches):
        rows = np.flatnonzero(mesh.batch[triangle] == number)
        if len(rows) == 0:
            continue
        if batch.texture is not None:
            base[rows] *= _sample(scene, batch.texture, uv[rows])
        if batch.alpha == "mask":
            opaque[rows] = base[rows, 3] >= batch.cutoff
        base[rows, :3] += np.asarray(batch.emissive)
    return Surface(np.clip(base[:, :3], 0.0, 1.0), normal, opaque)


def _sample(scene: PreparedScene, number: int, uv: Floats) -> Floats:
    """The nearest texel, linear RGBA (n, 4)."""
    texture = scene.info.textures[number]
    with Image.open(scene.folder / "textures" / texture.file) as image:
        pixels = np.asarray(image.convert("RGBA"))
    cells = []
    for axis, (wrap, size) in enumerate(
        ((texture.wrap_u, texture.width), (texture.wrap_v, texture.height))
    ):
        t = uv[:, axis]
        if wrap == "clamp":
            t = np.clip(t, 0.0, 1.0)
        elif wrap == "mirror":
            t = 1.0 - np.abs(np.mod(t, 2.0) - 1.0)
        else:
            t = np.mod(t, 1.0)
        cells.append(np.minimum((t * size).astype(np.int64), size - 1))
    found = pixels[cells[1], cells[0]] / 255.0
    return np.concatenate([to_linear(found[:, :3]), found[:, 3:]], axis=1)
