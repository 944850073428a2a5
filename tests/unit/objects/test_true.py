"""True impostors: height fields against rays cast at every triangle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from farfield.__main__ import main
from farfield_core.errors import BadInputError
from farfield_core.scene import open_scene
from farfield_worker.demo.asteroid import icosphere, write_asteroid
from farfield_worker.objects.cast import cast_rays
from farfield_worker.objects.columns import cross_columns
from farfield_worker.objects.error import measure, outline, outline_distance, sphere
from farfield_worker.objects.fields import Fields, bake_fields
from farfield_worker.objects.mesh import ObjectMesh, read_mesh
from farfield_worker.objects.slabs import is_closed, make_slabs
from farfield_worker.prepare import prepare
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from tests.unit.soup import soup

Floats = NDArray[np.float64]


def torus(rings: int = 24, sides: int = 16, inner: float = 0.4) -> Floats:
    """A torus about z, corners (m, 3, 3)."""
    u, v = np.meshgrid(np.arange(rings + 1), np.arange(sides + 1), indexing="ij")
    u, v = 2 * np.pi * (u % rings) / rings, 2 * np.pi * (v % sides) / sides
    p = np.stack(
        [(1 + inner * np.cos(v)) * np.cos(u), (1 + inner * np.cos(v)) * np.sin(u)], axis=-1
    )
    p = np.concatenate([p, inner * np.sin(v)[..., None]], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    return np.concatenate(
        [np.stack([a, b, c], axis=-2).reshape(-1, 3, 3), np.stack([a, c, d], -2).reshape(-1, 3, 3)]
    )


def mesh_of(corners: Floats) -> ObjectMesh:
    """Corners as an object without colours."""
    scene = soup(corners)
    exact = corners.reshape(-1, 3).astype(np.float32)
    _, places = np.unique(exact, axis=0, return_inverse=True)
    return ObjectMesh(
        exact.reshape(-1, 3, 3).astype(np.float64),
        np.asarray(scene.triangles, np.int64),
        places.reshape(-1, 3).astype(np.int64),
        np.zeros(len(corners), np.int64),
        scene,
    )


def ray_hits(corners: Floats, origins: Floats, directions: Floats) -> Floats:
    """The oracle: all distances, (rays, triangles), inf where a triangle is missed."""
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], e2)
    det = (p * e1).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origins[:, None] - a
        u = (s * p).sum(-1) / det
        q = np.cross(s, e1)
        v = (directions[:, None] * q).sum(-1) / det
        t = (e2 * q).sum(-1) / det
    hit = (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return np.where(hit, t, np.inf)


def scaled(corners: Floats) -> Floats:
    """Corners moved into [0.02, 0.98]³."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return np.asarray(0.02 + 0.96 * (corners - low) / (high - low).max())


@given(st.integers(0, 2**31), st.integers(1, 20))
@settings(max_examples=30, deadline=None)
def test_columns_cross_what_rays_cross(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.random((count, 3, 3))
    size = 12
    found = cross_columns(corners, size)
    centres = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(centres, centres)
    origins = np.stack([x.ravel(), y.ravel(), np.full(x.size, -1.0)], axis=1)
    hits = ray_hits(corners, origins, np.tile([0.0, 0.0, 1.0], (x.size, 1))) - 1
    for column in range(size * size):
        rows = slice(found.starts[column], found.starts[column + 1])
        wanted = np.sort(hits[column][np.isfinite(hits[column])])
        np.testing.assert_allclose(found.height[rows], wanted, atol=1e-9)
        for height, triangle, weights in zip(
            found.height[rows], found.triangle[rows], found.weights[rows], strict=True
        ):
            point = weights @ corners[triangle]
            np.testing.assert_allclose(point, [*origins[column, :2], height], atol=1e-9)


@pytest.mark.parametrize("size", [8, 16, 32])
def test_a_closed_mesh_is_entered_as_often_as_left(size: int) -> None:
    # Corners lie exactly on the columns: a shared edge must count once.
    points, faces = icosphere(2)
    grid = np.round(points * size / 2) / size + 0.5 + 0.5 / size
    found = cross_columns(np.ascontiguousarray(grid[faces]), size)
    for column in range(size * size):
        rows = slice(found.starts[column], found.starts[column + 1])
        assert found.enters[rows].sum() * 2 == rows.stop - rows.start


def test_slabs_are_where_a_point_is_inside() -> None:
    corners = scaled(np.concatenate([torus(), torus() @ np.diag([1, 1, -1])[:, [0, 2, 1]]]))
    size = 24
    slabs = make_slabs(
        found := cross_columns(corners, size), size, 4, True, np.zeros(len(found.height))
    )
    assert slabs.closed == 0
    rng = np.random.default_rng(5)
    cells, heights = rng.integers(0, size, (400, 2)), rng.random(400)
    points = np.column_stack([(cells + 0.5) / size, heights])
    hits = ray_hits(corners, points, np.tile([0.0, 0.0, 1.0], (400, 1)))
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    winding = (np.isfinite(hits) * np.sign(up)).sum(axis=1)
    for (x, y), height, turns in zip(cells, heights, winding, strict=True):
        inside = (slabs.low[:, y, x] <= height) & (height <= slabs.high[:, y, x])
        assert inside.any() == (turns > 0)


def test_too_many_slabs_close_the_narrowest_gap() -> None:
    def sheet(z: float, up: bool) -> Floats:
        a, b, c, d = ([0, 0, z], [1, 0, z], [1, 1, z], [0, 1, z])
        faces = [[a, b, c], [a, c, d]]
        return np.array(faces if up else [face[::-1] for face in faces], float)

    stack = np.concatenate(
        [sheet(z, up) for z, up in ((0.1, 0), (0.3, 1), (0.35, 0), (0.6, 1), (0.8, 0), (0.9, 1))]
    )
    slabs = make_slabs(found := cross_columns(stack, 4), 4, 2, True, np.zeros(len(found.height)))
    np.testing.assert_allclose(slabs.low[:, 1, 2], [0.1, 0.8])
    np.testing.assert_allclose(slabs.high[:, 1, 2], [0.6, 0.9])
    assert slabs.closed == pytest.approx(0.05 / 0.6)


def test_closed_and_open_meshes_are_told_apart() -> None:
    ball = mesh_of(icosphere(1)[0][icosphere(1)[1]])
    assert is_closed(ball.welded)
    assert not is_closed(ball.welded[1:])
    assert not is_closed(ball.welded[:, ::-1][:5])


def first_hits(mesh: ObjectMesh, fields: Fields, seed: int) -> tuple[Floats, Floats]:
    """Distances from around to points in the box: of the impostor, and of the mesh."""
    rng = np.random.default_rng(seed)
    away = rng.normal(size=(600, 3))
    middle, reach = (fields.low + fields.high) / 2, fields.high - fields.low
    origins = middle + 3 * away / np.linalg.norm(away, axis=1, keepdims=True) * reach.max()
    targets = middle + (rng.random((600, 3)) - 0.5) * reach
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = ray_hits(mesh.corners, origins, directions).min(axis=1)
    return cast_rays(fields, origins, directions, 400), hits


@pytest.mark.parametrize("shape", ["ball", "torus", "linked"])
def test_rays_meet_the_impostor_where_they_meet_the_mesh(shape: str) -> None:
    points, faces = icosphere(3)
    ring = torus(inner=0.25)
    turned = ring[..., [0, 2, 1]] * (1, 1, -1) + (1, 0, 0)
    corners = {
        "ball": points[faces],
        "torus": torus(),
        "linked": np.concatenate([ring, turned]),
    }[shape]
    mesh = mesh_of(corners)
    fields = bake_fields(mesh, 96, 2)
    found, wanted = first_hits(mesh, fields, 3)
    texel = float((fields.high - fields.low).max()) / 96
    agree = np.isfinite(found) == np.isfinite(wanted)
    assert agree.mean() > 0.98
    both = np.isfinite(found) & np.isfinite(wanted)
    assert both.sum() > 100
    off = np.abs(found[both] - wanted[both])
    assert np.quantile(off, 0.9) < 2 * texel


def test_the_measured_outline_error_is_small_and_notices_a_wrong_object(tmp_path: Path) -> None:
    write_asteroid(tmp_path / "stone.glb", 3)
    prepare(tmp_path / "stone.glb", tmp_path / "prepared", "stone", "stone")
    mesh = read_mesh(open_scene(tmp_path / "prepared"))
    fields = bake_fields(mesh, 96, 1)
    error = measure(fields, mesh)
    assert error.silhouette < 0.01
    texel = float((fields.high - fields.low).max()) / 96
    assert error.metres <= 3 * texel
    shrunk = fields._replace(high=fields.high - 0.1 * (fields.high - fields.low))
    assert measure(shrunk, mesh).silhouette > 0.2
    # Colours and normals are those of the surface.
    on = fields.heights[..., 1] >= fields.heights[..., 0]
    normal = fields.normals[1][on[0]] / 127.5 - 1
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=0.02)
    # tops face up, but for smoothed normals at the rim
    assert (normal[:, fields.axes[2]] < -0.05).mean() < 0.02
    assert (fields.colors[0][on[0]].max(axis=0) > fields.colors[0][on[0]].min(axis=0) + 20).all()


def test_sheets_are_a_texel_thick() -> None:
    card = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    mesh = mesh_of(np.concatenate([card, card[:, ::-1]]))
    fields = bake_fields(mesh._replace(corners=mesh.corners[:2], welded=mesh.welded[:2]), 32, 1)
    assert fields.axes[2] == 2
    error = measure(fields, mesh)
    assert error.silhouette < 0.05


def test_outlines() -> None:
    mask = np.zeros((9, 9), np.bool_)
    mask[2:7, 2:7] = True
    assert outline(mask).sum() == 16
    assert (outline_distance(mask, mask) == 0).all()
    assert set(outline_distance(mask, np.roll(mask, 2, axis=1))) == {0, 1, 2}
    assert (outline_distance(mask, np.zeros_like(mask)) == 8).all()
    directions = sphere(50)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    assert np.abs(directions.mean(axis=0)).max() < 0.03


def test_an_empty_object_is_refused() -> None:
    empty = mesh_of(torus())
    with pytest.raises(BadInputError, match="no triangles"):
        bake_fields(empty._replace(corners=np.zeros((0, 3, 3))), 32, 1)


def test_bake_object_writes_what_it_says(tmp_path: Path, capsys: Any) -> None:
    assert write_asteroid(tmp_path / "stone.glb", 2) == 320
    out = tmp_path / "out"
    arguments = [str(tmp_path / "stone.glb"), "--out", str(out), "--resolution", "48", "--json"]
    assert main(["bake-object", *arguments]) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert figures["triangles"] == 320
    text = json.loads((out / "object.json").read_text())
    assert figures.items() <= text.items()
    with Image.open(out / "object.png") as image:
        assert image.size == (48, 9 * 48)
        assert image.mode == "RGBA"
    assert sorted(text["axes"]) == [0, 1, 2]


def test_bake_object_says_what_is_missing(tmp_path: Path, capsys: Any) -> None:
    assert main(["bake-object", str(tmp_path / "no.glb"), "--out", str(tmp_path / "out")]) != 0
    assert "There is no model file" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
