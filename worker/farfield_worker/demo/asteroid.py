"""An asteroid: a sphere of triangles with dents, for examples and benches of object impostors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.glb import GlbWriter, Primitive

Floats = NDArray[np.float64]


def write_asteroid(path: Path, subdivisions: int = 4, seed: int = 1) -> int:
    """Write a GLB of 20 * 4**subdivisions triangles, about 2.5 m across; returns their number."""
    points, triangles = icosphere(subdivisions)
    rng = np.random.default_rng(seed)
    shape = points.copy()
    for wave in range(6):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        shape *= (1 + 0.12 * np.sin(3 * (shape @ along) + wave))[:, None]
    edges = shape[triangles]
    flat = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    normals = np.zeros_like(shape)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], flat)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    grain = 0.5 + 0.5 * np.sin(5 * shape[:, :1] + 3 * np.sin(4 * shape[:, 1:2] + 2 * shape[:, 2:]))
    grey = np.array([0.16, 0.13, 0.10]) + grain * np.array([0.25, 0.22, 0.18])
    colors = np.concatenate([255 * grey, np.full((len(grey), 1), 255.0)], axis=1)
    writer = GlbWriter("Farfield asteroid")
    primitive = Primitive(
        writer.material("stone", None),
        shape.astype(np.float32),
        normals.astype(np.float32),
        np.zeros((len(shape), 2), np.float32),
        colors.astype(np.uint8),
        triangles.astype(np.uint32),
    )
    writer.mesh("asteroid", [primitive])
    writer.write(path)
    return len(triangles)


def icosphere(subdivisions: int) -> tuple[Floats, NDArray[np.int64]]:
    """Unit points (n, 3) and triangles (20 * 4**subdivisions, 3), wound to be seen from outside."""
    g = (1 + 5**0.5) / 2
    points = np.array([[s * 1.0, t * g, 0.0] for s in (-1, 1) for t in (-1, 1)])
    points = np.concatenate([points, points[:, [2, 0, 1]], points[:, [1, 2, 0]]])
    # The faces of an icosahedron: all triples of corners at the shortest distance.
    near = np.abs(np.linalg.norm(points[:, None] - points[None], axis=-1) - 2) < 1e-9
    faces = np.array(
        [
            (a, b, c)
            for a in range(12)
            for b in range(a + 1, 12)
            for c in range(b + 1, 12)
            if near[a, b] and near[b, c] and near[a, c]
        ]
    )
    corners = points[faces]
    outward = np.einsum(
        "nk,nk->n",
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
        corners[:, 0],
    )
    faces[outward < 0] = faces[outward < 0][:, [0, 2, 1]]
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(subdivisions):
        a, b, c = faces.T
        edges = np.sort(np.concatenate([np.stack(pair, 1) for pair in ((a, b), (b, c), (c, a))]), 1)
        ends, number = np.unique(edges, axis=0, return_inverse=True)
        middles = points[ends].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        ab, bc, ca = (number.reshape(3, -1) + len(points)).reshape(3, -1)
        points = np.concatenate([points, middles])
        faces = np.concatenate(
            [np.stack(face, 1) for face in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    return points, faces
