"""PLY and STL."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from farfield_core.errors import SceneRefusedError
from farfield_shading import to_linear

from tests.unit.prepare.build import canonical, facing, flat_color, png, prepared, soup

ASCII_PLY = """ply
format ascii 1.0
comment TextureFile t.png
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property float s
property float t
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0 0 0 0
1 0 0 255 0 0 1 0
1 1 0 255 0 0 1 1
0 1 0 255 128 0 0 1
4 0 1 2 3
"""


def test_ascii_ply_with_quads_colours_and_texture(tmp_path):
    (tmp_path / "t.png").write_bytes(png(flat_color(5, 6, 7)))
    path = tmp_path / "m.ply"
    path.write_text(ASCII_PLY)
    scene = prepared(path, tmp_path)
    s = soup(scene)
    assert scene.info.triangles == 2
    assert np.allclose(facing(s.positions), (0, 0, 1))
    corner = np.isclose(s.positions, (0, 1, 0)).all(axis=-1)
    assert np.allclose(s.colors[corner][:, 1], to_linear(np.array(128 / 255)), atol=1e-4)
    assert np.allclose(s.uvs[..., 1], 1 - s.positions[..., 1])
    assert scene.info.batches[0].texture == 0
    assert scene.info.batches[0].double_sided


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_like_trimesh(tmp_path, encoding):
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.visual.vertex_colors = np.random.default_rng(1).integers(0, 255, (len(ball.vertices), 4))
    path = tmp_path / "m.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(ball, encoding=encoding))
    scene = prepared(path, tmp_path)
    s = soup(scene)
    assert canonical(s.positions) == canonical(ball.triangles)
    assert scene.info.batches[0].alpha == "mask"


def test_ply_face_colours(tmp_path):
    box = trimesh.creation.box()
    box.visual.face_colors = np.tile([0, 0, 255, 255], (12, 1))
    path = tmp_path / "m.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(box))
    assert np.allclose(soup(prepared(path, tmp_path)).colors, (0, 0, 1, 1))


@pytest.mark.parametrize("counts", [(2_000_000_000, 1), (4, 2_000_000_000), (10**30, 10**30)])
def test_ply_counts_that_lie_are_refused(tmp_path, counts):
    path = tmp_path / "m.ply"
    path.write_text(
        ASCII_PLY.replace("vertex 4", f"vertex {counts[0]}").replace("face 1", f"face {counts[1]}")
    )
    with pytest.raises(SceneRefusedError, match="promises at least"):
        prepared(path, tmp_path)


def test_ply_points_alone_are_refused(tmp_path):
    cloud = trimesh.PointCloud(np.random.default_rng(1).random((10, 3)))
    path = tmp_path / "m.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(cloud))
    with pytest.raises(SceneRefusedError, match="holds no triangles"):
        prepared(path, tmp_path)


def test_binary_ply_of_mixed_polygons_is_refused(tmp_path):
    header = ASCII_PLY.split("end_header", maxsplit=1)[0].replace("ascii", "binary_little_endian")
    vertices = np.zeros(4, "f4,f4,f4,u1,u1,u1,f4,f4").tobytes()
    faces = b"\3" + np.arange(3, dtype="i4").tobytes() + b"\4" + np.arange(4, dtype="i4").tobytes()
    path = tmp_path / "m.ply"
    head = header.replace("face 1", "face 2") + "end_header\n"
    path.write_bytes(head.encode() + vertices + faces)
    with pytest.raises(SceneRefusedError, match="different numbers of corners"):
        prepared(path, tmp_path)


@pytest.mark.parametrize("form", ["stl", "stl_ascii"])
def test_stl(tmp_path, form):
    box = trimesh.creation.box((1, 2, 3))
    path = tmp_path / "m.stl"
    data = box.export(file_type=form)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    scene = prepared(path, tmp_path)
    s = soup(scene)
    assert canonical(s.positions) == canonical(box.triangles)
    assert np.allclose(s.normals, facing(s.positions)[:, None])
    assert (s.colors == 1).all()
    # corners of coplanar triangles are shared
    assert scene.info.vertices == 24


def test_stl_of_several_solids(tmp_path):
    text = trimesh.creation.box().export(file_type="stl_ascii")
    other = trimesh.creation.box()
    other.apply_translation((5, 0, 0))
    path = tmp_path / "m.stl"
    path.write_text(text + other.export(file_type="stl_ascii"))
    assert prepared(path, tmp_path).info.triangles == 24


def test_stl_count_that_lies_is_refused(tmp_path):
    data = bytearray(io.BytesIO(trimesh.creation.box().export(file_type="stl")).getvalue())
    data[80:84] = (2_000_000_000).to_bytes(4, "little")
    path = tmp_path / "m.stl"
    path.write_bytes(data)
    with pytest.raises(SceneRefusedError):
        prepared(path, tmp_path)
