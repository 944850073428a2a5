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
        corners: (m, 3, 3) float64, metres, scene coordinates.
        welded: (m, 3) int64, corners numbered by place.
        batch: (m,) int64.
        scene: where normals, colours and textures come from.
    """

    corners: Floats
    welded: NDArray[np.int64]
    batch: NDArray[np.int64]
    scene: PreparedScene


class Surface(NamedTuple):
    """The surface at n points: `color` (n, 3) linear, `normal` (n, 3) unit, `opaque` (n,) bool."""

    color: Floats
    normal: Floats
    opaque: NDArray[np.bool_]


def read_mesh(scene: PreparedScene) -> ObjectMesh:
    """Take all of a prepared scene as one object."""
    positions = scene.positions.astype(np.float64) + scene.origin
    _, places = np.unique(scene.positions, axis=0, return_inverse=True)
    batch = np.zeros(len(scene.triangles), np.int64)
    for block in scene.info.blocks:
        for part in block.parts:
            batch[part.first_triangle : part.first_triangle + part.triangles] = part.batch
    triangles = np.asarray(scene.triangles, np.int64)
    return ObjectMesh(positions[triangles], places.reshape(-1)[triangles], batch, scene)


def surface_at(mesh: ObjectMesh, triangle: NDArray[np.int64], weights: Floats) -> Surface:
    """The surface at points of triangles: `triangle` (n,), `weights` (n, 3) barycentric."""
    scene = mesh.scene
    vertices = np.asarray(scene.triangles, np.int64)[triangle]
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
        pixels = np.asarray(image.convert("RGBA")) / 255.0
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
    found = pixels[cells[1], cells[0]]
    return np.concatenate([to_linear(found[:, :3]), found[:, 3:]], axis=1)
