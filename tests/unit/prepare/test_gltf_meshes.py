"""Geometry of glTF files: what stands where, and which way it faces."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
import trimesh
from farfield_core.errors import SceneRefusedError
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.unit.prepare.build import (
    QUAD,
    QUAD_TRIANGLES,
    UP_Z,
    Gltf,
    canonical,
    facing,
    one_quad,
    prepared,
    soup,
)

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], "f4")


def test_one_square(tmp_path):
    scene = prepared(one_quad(NORMAL=UP_Z), tmp_path)
    assert scene.info.triangles == 2
    assert scene.info.vertices == 4
    assert scene.info.bounds.min == (0, 0, 0)
    assert scene.info.bounds.max == (1, 1, 0)
    assert scene.info.id == "s"
    assert scene.info.name == "A scene"
    assert (soup(scene).normals == (0, 0, 1)).all()


def test_instances_stand_where_their_nodes_are(tmp_path):
    gltf = Gltf()
    mesh = gltf.mesh(gltf.quad())
    child = gltf.node(top=False, mesh=mesh, translation=[0, 5, 0])
    gltf.node(mesh=mesh, translation=[10, 0, 0], children=[child])
    gltf.node(mesh=mesh, scale=[2, 3, 1])
    scene = prepared(gltf, tmp_path)
    where = sorted(tuple(t.min(axis=0).tolist()) for t in soup(scene).positions)
    assert where == sorted([(10, 0, 0)] * 2 + [(10, 5, 0)] * 2 + [(0, 0, 0)] * 2)
    assert scene.info.bounds.max == (11, 6, 0)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -2, 1], [1, 1, -1], [-1, -1, -1], [-2, -1, 1]])
def test_mirrored_instances_keep_their_front(tmp_path, scale):
    gltf = one_quad(NORMAL=UP_Z)
    gltf.root["nodes"][0]["scale"] = scale
    s = soup(prepared(gltf, tmp_path))
    front = [0, 0, np.sign(scale[2])]
    assert np.allclose(s.normals, front)
    assert np.allclose(facing(s.positions), front)


numbers = st.floats(-3, 3, width=32).map(lambda x: round(x, 2))


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(
        st.tuples(
            st.tuples(numbers, numbers, numbers),
            st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: np.linalg.norm(q) > 0.1),
            st.tuples(*[st.sampled_from([-2.0, -1.0, 0.5, 1.5])] * 3),
            st.integers(0, 3),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_trees_agree_with_trimesh(tmp_path, nodes):
    gltf = Gltf()
    mesh = gltf.mesh({"attributes": {"POSITION": gltf.accessor(CORNER)}})
    for n, (translation, rotation, scale, parent) in enumerate(nodes):
        unit = (np.array(rotation) / np.linalg.norm(rotation)).tolist()
        gltf.node(top=parent >= n, mesh=mesh, translation=translation, rotation=unit, scale=scale)
        if parent < n:
            gltf.root["nodes"][parent].setdefault("children", []).append(n)
    ours = soup(prepared(gltf, tmp_path)).positions
    loaded = trimesh.load_scene(io.BytesIO(gltf.glb()), file_type="glb", process=False)
    theirs = loaded.to_geometry().triangles
    # order both by centroid, then compare corners up to the choice of the first one
    ours = ours[np.lexsort(np.round(ours.mean(axis=1), 3).T)]
    theirs = theirs[np.lexsort(np.round(theirs.mean(axis=1), 3).T)]
    assert len(ours) == len(theirs) == len(nodes)
    best = [
        min(np.abs(np.roll(a, k, axis=0) - b).max() for k in range(3) for b in theirs) for a in ours
    ]
    assert max(best) < 1e-4


def test_matrix_nodes(tmp_path):
    gltf = one_quad()
    gltf.root["nodes"][0]["matrix"] = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]
    scene = prepared(gltf, tmp_path)
    assert scene.info.bounds.min == (6, 8, 9)
    assert scene.info.bounds.max == (7, 9, 9)


def test_flattened_instances_keep_what_has_area(tmp_path):
    gltf = one_quad()
    gltf.node(mesh=0, scale=[1, 1, 0], translation=[5, 0, 0])
    gltf.node(mesh=0, scale=[0, 1, 1], translation=[9, 0, 0])
    scene = prepared(gltf, tmp_path)
    assert scene.info.triangles == 4
    assert scene.info.bounds.max == (6, 1, 0)
    assert scene.info.notes == ("2 triangles without area were left out.",)


@pytest.mark.parametrize(("mode", "name"), [(5, "strip"), (6, "fan")])
def test_strips_and_fans(tmp_path, mode, name):
    order = [0, 1, 3, 2] if name == "strip" else [0, 1, 2, 3]
    gltf = Gltf()
    primitive = gltf.quad(NORMAL=UP_Z) | {
        "mode": mode,
        "indices": gltf.accessor(np.array(order, "u1")),
    }
    gltf.node(mesh=gltf.mesh(primitive))
    s = soup(prepared(gltf, tmp_path))
    assert len(s.positions) == 2
    assert np.allclose(facing(s.positions), (0, 0, 1))
    area = np.linalg.norm(
        np.cross(s.positions[:, 1] - s.positions[:, 0], s.positions[:, 2] - s.positions[:, 0]),
        axis=1,
    )
    assert area.sum() == 2


def test_lines_and_points_are_noted(tmp_path):
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(gltf.quad(), gltf.quad() | {"mode": 1}, gltf.quad() | {"mode": 0}))
    scene = prepared(gltf, tmp_path)
    assert scene.info.triangles == 2
    assert scene.info.notes == ("Lines and points were left out.",)


def test_missing_normals_are_flat(tmp_path):
    box = trimesh.creation.box()
    gltf = Gltf()
    primitive = {
        "attributes": {"POSITION": gltf.accessor(box.vertices.astype("f4"))},
        "indices": gltf.accessor(box.faces.astype("u4").reshape(-1)),
    }
    gltf.node(mesh=gltf.mesh(primitive))
    scene = prepared(gltf, tmp_path)
    s = soup(scene)
    assert np.allclose(s.normals, facing(s.positions)[:, None])
    assert scene.info.vertices == 24


def test_normals_turn_with_uneven_scales(tmp_path):
    slope = np.array([[0, 0, 0], [1, 0, -1], [1, 1, -1], [0, 1, 0]], "f4")
    normal = np.tile(np.array([1, 0, 1], "f4") / np.sqrt(2).astype("f4"), (4, 1))
    gltf = one_quad(POSITION=slope, NORMAL=normal)
    gltf.root["nodes"][0]["scale"] = [4, 1, 1]
    s = soup(prepared(gltf, tmp_path))
    assert np.allclose(s.normals, facing(s.positions)[:, None], atol=0.01)


def test_degenerate_and_non_finite_triangles_are_dropped(tmp_path):
    positions = np.concatenate([QUAD, [[np.nan, 0, 0], [np.inf, 1, 0], [2, 2, 0]]]).astype("f4")
    corners = np.array([0, 1, 2, 0, 2, 3, 0, 0, 1, 0, 1, 4, 1, 2, 5, 0, 2, 6], "u2")
    gltf = Gltf()
    primitive = {
        "attributes": {"POSITION": gltf.accessor(positions)},
        "indices": gltf.accessor(corners),
    }
    gltf.node(mesh=gltf.mesh(primitive))
    scene = prepared(gltf, tmp_path)
    assert scene.info.triangles == 2
    assert scene.info.bounds.max == (1, 1, 0)
    assert scene.info.notes == ("4 triangles without area were left out.",)


def test_double_sided_winding_follows_the_normals(tmp_path):
    s = soup(prepared(one_quad({"doubleSided": True}, NORMAL=-UP_Z), tmp_path))
    assert np.allclose(s.normals, (0, 0, -1))
    assert np.allclose(facing(s.positions), (0, 0, -1))


def test_single_sided_normals_follow_the_winding(tmp_path):
    s = soup(prepared(one_quad({}, NORMAL=-UP_Z), tmp_path))
    assert np.allclose(s.normals, (0, 0, 1))
    assert np.allclose(facing(s.positions), (0, 0, 1))


def test_strided_and_shared_buffers(tmp_path):
    gltf = Gltf()
    rows = np.zeros((100, 8), "f4")
    rows[:, :3] = np.arange(100)[:, None]
    rows[40:44, :3], rows[40:44, 3:6] = QUAD, UP_Z
    view = gltf.view(rows.tobytes(), byteStride=32)
    positions = gltf.accessor(rows[:, :3], view)
    normals = gltf.accessor(rows[:, 3:6], view, byteOffset=12)
    primitive = {
        "attributes": {"POSITION": positions, "NORMAL": normals},
        "indices": gltf.accessor(QUAD_TRIANGLES + np.uint16(40)),
    }
    gltf.node(mesh=gltf.mesh(primitive))
    scene = prepared(gltf, tmp_path)
    assert scene.info.vertices == 4
    assert scene.info.bounds.max == (1, 1, 0)


def test_sparse_accessors(tmp_path):
    gltf = Gltf()
    positions = gltf.accessor(
        QUAD,
        sparse={
            "count": 1,
            "indices": {"bufferView": gltf.view(b"\2"), "componentType": 5121},
            "values": {"bufferView": gltf.view(np.array([4, 5, 6], "f4").tobytes())},
        },
    )
    gltf.node(mesh=gltf.mesh(gltf.quad(POSITION=positions)))
    assert prepared(gltf, tmp_path).info.bounds.max == (4, 5, 6)


def test_gpu_instancing(tmp_path):
    gltf = one_quad()
    where = np.array([[0, 0, 0], [10, 0, 0], [20, 0, 0]], "f4")
    scale = np.array([[1, 1, 1], [2, 2, 2], [1, 1, 1]], "f4")
    gltf.root["nodes"][0]["extensions"] = {
        "EXT_mesh_gpu_instancing": {
            "attributes": {"TRANSLATION": gltf.accessor(where), "SCALE": gltf.accessor(scale)}
        }
    }
    gltf.root["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    scene = prepared(gltf, tmp_path)
    assert scene.info.triangles == 6
    assert scene.info.bounds.max == (21, 2, 0)


def test_files_beside_a_gltf(tmp_path):
    gltf = one_quad(NORMAL=UP_Z)
    (tmp_path / "a buffer.bin").write_bytes(bytes(gltf.body))
    root = gltf.root | {"buffers": [{"uri": "a%20buffer.bin", "byteLength": len(gltf.body)}]}
    path = tmp_path / "model.gltf"
    path.write_text(json.dumps(root))
    assert prepared(path, tmp_path).info.triangles == 2


def test_only_the_default_scene_is_drawn(tmp_path):
    gltf = one_quad()
    gltf.node(top=False, mesh=0, translation=[100, 0, 0])
    gltf.root["scenes"].append({"nodes": [1]})
    assert prepared(gltf, tmp_path).info.bounds.max == (1, 1, 0)
    gltf.root["scene"] = 1
    assert prepared(gltf, tmp_path).info.bounds.max == (101, 1, 0)
    del gltf.root["scenes"], gltf.root["scene"]
    assert prepared(gltf, tmp_path).info.triangles == 4


@pytest.mark.parametrize("children", [[0], [1, 1]])
def test_graphs_that_are_no_trees_are_refused(tmp_path, children):
    gltf = one_quad()
    gltf.node(top=False, mesh=0)
    gltf.root["nodes"][0]["children"] = children
    with pytest.raises(SceneRefusedError, match="not a tree"):
        prepared(gltf, tmp_path)


def test_far_away_models_keep_their_detail(tmp_path):
    gltf = one_quad()
    gltf.root["nodes"][0]["translation"] = [5e6, 0, -4e6]
    scene = prepared(gltf, tmp_path)
    assert scene.info.origin == (5e6, 0, -4e6)
    edges = canonical(soup(scene).positions - scene.origin)
    assert edges == canonical(QUAD.astype(float)[QUAD_TRIANGLES].reshape(-1, 3, 3))
