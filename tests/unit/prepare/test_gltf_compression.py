"""Compressed and quantised glTF files, made by the encoders of the packages that decode them."""

from __future__ import annotations

import DracoPy
import meshoptimizer
import numpy as np
import pytest
from farfield_core.errors import SceneRefusedError

from tests.unit.prepare.build import (
    QUAD,
    QUAD_TRIANGLES,
    QUAD_UVS,
    UP_Z,
    Gltf,
    canonical,
    flat_color,
    prepared,
    soup,
)

EXPECTED = canonical(QUAD.astype(float)[QUAD_TRIANGLES].reshape(-1, 3, 3))


def meshopt_view(gltf: Gltf, data: bytes, count: int, stride: int, mode: str, **extra) -> int:
    """A buffer view whose plain bytes are only promised, as compressors write it."""
    packed = gltf.view(data)
    source = gltf.root["bufferViews"].pop(packed)
    extension = source | {"count": count, "byteStride": stride, "mode": mode} | extra
    entry = {
        "buffer": 1,
        "byteLength": count * stride,
        "extensions": {"EXT_meshopt_compression": extension},
    }
    return gltf.add("bufferViews", entry)


def meshopt_quad(gltf: Gltf, mode: str = "TRIANGLES") -> dict:
    positions = meshopt_view(gltf, meshoptimizer.encode_vertex_buffer(QUAD), 4, 12, "ATTRIBUTES")
    encode = (
        meshoptimizer.encode_index_buffer
        if mode == "TRIANGLES"
        else meshoptimizer.encode_index_sequence
    )
    indices = meshopt_view(gltf, encode(QUAD_TRIANGLES), 6, 2, mode)
    return {
        "attributes": {"POSITION": gltf.accessor(QUAD, positions)},
        "indices": gltf.accessor(QUAD_TRIANGLES, indices),
    }


@pytest.mark.parametrize("mode", ["TRIANGLES", "INDICES"])
def test_meshopt(tmp_path, mode):
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(meshopt_quad(gltf, mode)))
    gltf.root["extensionsRequired"] = ["EXT_meshopt_compression"]
    assert canonical(soup(prepared(gltf, tmp_path)).positions) == EXPECTED


def test_meshopt_octahedral_normals(tmp_path):
    gltf = Gltf()
    primitive = meshopt_quad(gltf)
    tilted = np.tile(np.array([0.6, 0, 0.8]), (4, 1))
    # x and y of the point where the normal meets the octahedron |x| + |y| + |z| = 127
    octahedral = np.zeros((4, 4), "i1")
    octahedral[:, :2] = np.rint(tilted[:, :2] / 1.4 * 127)
    octahedral[:, 2] = 127
    data = meshoptimizer.encode_vertex_buffer(octahedral.view("u1"))
    view = meshopt_view(gltf, data, 4, 4, "ATTRIBUTES", filter="OCTAHEDRAL")
    primitive["attributes"]["NORMAL"] = gltf.accessor(octahedral[:, :3], view, normalized=True)
    gltf.node(mesh=gltf.mesh(primitive))
    assert np.allclose(soup(prepared(gltf, tmp_path)).normals, (0.6, 0, 0.8), atol=0.02)


def test_meshopt_exponential_positions(tmp_path):
    gltf = Gltf()
    primitive = meshopt_quad(gltf)
    # value = mantissa * 2^exponent: 24 and 8 bits of one word
    words = (QUAD * 4).astype("i4") & 0xFFFFFF | (-2 << 24)
    data = meshoptimizer.encode_vertex_buffer(words.astype("i4"))
    view = meshopt_view(gltf, data, 4, 12, "ATTRIBUTES", filter="EXPONENTIAL")
    primitive["attributes"]["POSITION"] = gltf.accessor(QUAD, view)
    gltf.node(mesh=gltf.mesh(primitive))
    assert canonical(soup(prepared(gltf, tmp_path)).positions) == EXPECTED


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 2_000_000_000}, "claims more"),
        ({"mode": "TRIANGLES"}, "damaged"),
        ({"mode": "SOMETHING"}, "damaged"),
        ({"byteStride": 7}, "damaged"),
        ({"filter": "QUATERNION"}, "filter"),
        ({"filter": "COLOR"}, "filter"),
        ({"byteLength": 5}, "damaged"),
    ],
)
def test_meshopt_lies_are_refused(tmp_path, change, message):
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(meshopt_quad(gltf)))
    gltf.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] |= change
    with pytest.raises(SceneRefusedError, match=message):
        prepared(gltf, tmp_path)


def draco_quad(gltf: Gltf, count: int = 4) -> dict:
    colors = np.tile(np.array([255, 0, 0, 255], np.uint8), (4, 1))
    data = DracoPy.encode(
        QUAD,
        QUAD_TRIANGLES.reshape(-1, 3).astype("u4"),
        quantization_bits=16,
        preserve_order=True,
        tex_coord=QUAD_UVS.astype(float),
        normals=UP_Z.astype(float),
        colors=colors,
    )
    ids = {entry["attribute_type"]: entry["unique_id"] for entry in DracoPy.decode(data).attributes}
    names = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2, "TEXCOORD_0": 3}
    attributes = {name: ids[kind] for name, kind in names.items()}
    promised = {
        "POSITION": (5126, "VEC3", False),
        "NORMAL": (5126, "VEC3", False),
        "COLOR_0": (5121, "VEC4", True),
        "TEXCOORD_0": (5126, "VEC2", False),
    }
    return {
        "attributes": {
            name: gltf.add(
                "accessors",
                {"componentType": kind, "type": shape, "normalized": norm, "count": count},
            )
            for name, (kind, shape, norm) in promised.items()
        },
        "indices": gltf.add("accessors", {"componentType": 5123, "type": "SCALAR", "count": 6}),
        "extensions": {
            "KHR_draco_mesh_compression": {"bufferView": gltf.view(data), "attributes": attributes}
        },
    }


def test_draco(tmp_path):
    gltf = Gltf()
    texture = gltf.texture(flat_color(10, 20, 30))
    gltf.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}})
    gltf.node(mesh=gltf.mesh(draco_quad(gltf) | {"material": 0}))
    gltf.root["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    scene = prepared(gltf, tmp_path)
    s = soup(scene)
    assert canonical(s.positions) == EXPECTED
    assert np.allclose(s.normals, (0, 0, 1), atol=0.01)
    assert np.allclose(s.colors, (1, 0, 0, 1))
    # u grows with x and v runs down
    assert np.allclose(s.uvs[..., 0], s.positions[..., 0], atol=1e-3)
    assert np.allclose(s.uvs[..., 1], 1 - s.positions[..., 1], atol=1e-3)


def test_draco_lies_are_refused(tmp_path):
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(draco_quad(gltf, count=2_000_000_000)))
    with pytest.raises(SceneRefusedError, match="claims more"):
        prepared(gltf, tmp_path)


def test_damaged_draco_is_refused(tmp_path):
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(draco_quad(gltf)))
    view = gltf.root["bufferViews"][0]
    gltf.body[view["byteOffset"] : view["byteOffset"] + 5] = b"OCARD"
    with pytest.raises(SceneRefusedError, match="Draco"):
        prepared(gltf, tmp_path)


@pytest.mark.parametrize(
    ("dtype", "normalized", "steps"),
    [
        ("i1", False, 100),
        ("u1", True, 255),
        ("i2", False, 3000),
        ("u2", True, 65535),
        ("i2", True, 32767),
    ],
)
def test_quantised_positions(tmp_path, dtype, normalized, steps):
    gltf = Gltf()
    packed = np.zeros((4, 4), dtype)
    packed[:, :3] = QUAD * steps
    view = gltf.view(packed.tobytes(), byteStride=packed.itemsize * 4)
    positions = gltf.accessor(packed[:, :3], view, normalized=normalized)
    normals = np.zeros((4, 4), "i1")
    normals[:, 2] = 127
    gltf.node(
        mesh=gltf.mesh(
            gltf.quad(
                POSITION=positions,
                NORMAL=gltf.accessor(
                    normals[:, :3], gltf.view(normals.tobytes(), byteStride=4), normalized=True
                ),
            )
        ),
        scale=[1.0 if normalized else 1 / steps] * 3,
    )
    gltf.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    s = soup(prepared(gltf, tmp_path))
    assert canonical(s.positions) == EXPECTED
    assert np.allclose(s.normals, (0, 0, 1))
