"""Near blocks as files."""

from __future__ import annotations

import hashlib
import io
import json
import struct
from typing import Any

import meshoptimizer
import numpy as np
import pytest
import trimesh
from farfield_core.errors import AlreadyExistsError, BadInputError
from farfield_core.scene import PreparedScene
from farfield_worker.near import NearBlocks
from farfield_worker.near.blobs import pack_uvs
from farfield_worker.near.quantise import common_step, finest_step, quantise
from farfield_worker.shoot.glb import read_near_block
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.unit.prepare.build import (
    QUAD_UVS,
    UP_Z,
    Gltf,
    flat_color,
    prepared,
    soup,
)

PACKED = "EXT_meshopt_compression"
WIDTHS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Store:
    """A create-only store."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}

    def put(self, key: str, data: bytes) -> None:
        if key in self.files:
            raise AlreadyExistsError("It is there already.")
        self.files[key] = data

    def get(self, name: str) -> bytes:
        return self.files["blobs/near/" + name]

    __getitem__ = get


def parse(data: bytes) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk of a GLB, its framing checked."""
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON"
    assert size % 4 == 0
    root = json.loads(data[20 : 20 + size])
    body = data[20 + size :]
    assert struct.unpack("<I4s", body[:8]) == (len(body) - 8, b"BIN\0")
    assert len(body) % 4 == 0
    return root, body[8:]


def check_rules(root: dict[str, Any], body: bytes) -> None:
    """Rules of the glTF specification about buffers, views and accessors."""
    own, unpacked = root["buffers"]
    assert own == {"byteLength": len(body)}
    assert unpacked["extensions"] == {PACKED: {"fallback": True}}
    for view in root["bufferViews"]:
        packed = view.get("extensions", {}).get(PACKED)
        assert view["buffer"] == (packed is not None)
        assert view["byteOffset"] % 4 == 0
        assert (
            view["byteOffset"] + view["byteLength"] <= root["buffers"][view["buffer"]]["byteLength"]
        )
        if packed is not None:
            assert packed["buffer"] == 0
            assert packed["byteOffset"] % 4 == 0
            assert packed["byteOffset"] + packed["byteLength"] <= len(body)
            assert packed["count"] * packed["byteStride"] == view["byteLength"]
            # index codec, version 1: the one that the extension describes
            assert body[packed["byteOffset"]] == 0xE1
        if view["target"] == 34962:
            assert view["byteStride"] % 4 == 0
            assert 4 <= view["byteStride"] <= 252
        else:
            assert "byteStride" not in view
    for accessor in root["accessors"]:
        view = root["bufferViews"][accessor["bufferView"]]
        element = WIDTHS[accessor["componentType"]] * SHAPES[accessor["type"]]
        start, stride = accessor.get("byteOffset", 0), view.get("byteStride", element)
        assert start % WIDTHS[accessor["componentType"]] == 0
        assert start + stride * (accessor["count"] - 1) + element <= view["byteLength"]
    for primitive in root["meshes"][0]["primitives"]:
        position = root["accessors"][primitive["attributes"]["POSITION"]]
        assert len(position["min"]) == len(position["max"]) == 3
        counts = {root["accessors"][a]["count"] for a in primitive["attributes"].values()}
        assert counts == {position["count"]}


def plain(data: bytes) -> bytes:
    """The same GLB with nothing packed, for readers that do not know how."""
    root, body = parse(data)
    for view in root["bufferViews"]:
        packed = view.pop("extensions", {}).get(PACKED)
        if packed is None:
            continue
        start, size = packed["byteOffset"], packed["byteLength"]
        indices = meshoptimizer.decode_index_buffer(packed["count"], 4, body[start : start + size])
        view |= {"buffer": 0, "byteOffset": len(body)}
        body += indices.astype(f"<u{packed['byteStride']}").tobytes()
        body += bytes(-len(body) % 4)
    root["buffers"] = [{"byteLength": len(body)}]
    root["extensionsRequired"].remove(PACKED)
    return glb(root, body)


def glb(root: dict[str, Any], body: bytes) -> bytes:
    """A GLB of two chunks."""
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> PreparedScene:
    """Eight looks in one scene of several blocks."""
    gltf = Gltf()
    wall, leaf = gltf.texture(flat_color(9, 9, 9)), flat_color(0, 99, 0)
    leaf[0, 0, 3] = 0
    leaf_texture = gltf.texture(leaf, wrapS=33071, wrapT=33648, magFilter=9728)
    surface = "pbrMetallicRoughness"
    looks: list[dict[str, Any]] = [
        {surface: {"baseColorFactor": [0.5, 0.25, 1, 1]}},
        {surface: {"baseColorTexture": {"index": wall}}},
        {surface: {"baseColorTexture": {"index": leaf_texture}}, "alphaMode": "MASK"},
        {surface: {"baseColorFactor": [1, 1, 1, 0.5]}, "alphaMode": "BLEND"},
        {"doubleSided": True},
        {"extensions": {"KHR_materials_unlit": {}}},
        {"emissiveFactor": [0.5, 0, 0]},
        {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": wall}},
    ]
    for n, look in enumerate(looks):
        gltf.add("materials", look)
        gltf.node(
            mesh=gltf.mesh(gltf.quad(n, TEXCOORD_0=QUAD_UVS, NORMAL=UP_Z)),
            translation=[2 * n, 0, 0],
        )
    ball = trimesh.creation.icosphere(subdivisions=5)
    primitive = {
        "attributes": {
            "POSITION": gltf.accessor(ball.vertices.astype("f4")),
            "NORMAL": gltf.accessor(ball.vertices.astype("f4")),
        },
        "indices": gltf.accessor(ball.faces.astype("u4").reshape(-1)),
        "material": 0,
    }
    gltf.node(mesh=gltf.mesh(primitive), scale=[30, 30, 30], translation=[500, 7, -300])
    return prepared(gltf, tmp_path_factory.mktemp("blobs"))


def test_blocks_are_valid_and_named_by_content(scene):
    store = Store()
    near = NearBlocks(scene, store.put)
    assert store.files == {}
    for index in range(len(scene.info.blocks)):
        name = near.blob(index)
        assert near.blob(index) == name
        data = store.get(name)
        assert name == hashlib.sha256(data).hexdigest()[:32] + ".glb"
        root, body = parse(data)
        check_rules(root, body)
        assert root["extensionsRequired"] == ["KHR_mesh_quantization", PACKED]
        for image in root.get("images", []):
            data = store.get(image["uri"])
            assert image["uri"] == hashlib.sha256(data).hexdigest()[:32] + ".png"


def test_every_process_makes_the_same_bytes(scene):
    first, second = Store(), Store()
    near = NearBlocks(scene, first.put)
    other = NearBlocks(scene, second.put)
    count = len(scene.info.blocks)
    names = [near.blob(index) for index in range(count)]
    assert names == [other.blob(index) for index in reversed(range(count))][::-1]
    assert first.files == second.files
    # a third finds everything there already
    assert [NearBlocks(scene, first.put).blob(index) for index in range(count)] == names


def test_triangles_survive_within_half_a_step(scene):
    store = Store()
    near = NearBlocks(scene, store.put)
    whole = soup(scene)
    for index, block in enumerate(scene.info.blocks):
        data = store.get(near.blob(index))
        root, _ = parse(data)
        step = root["nodes"][0]["scale"][0]
        loaded = trimesh.load_scene(
            io.BytesIO(plain(data)), file_type="glb", resolver=store, process=False
        )
        meshes = loaded.dump()
        assert len(meshes) == len(block.parts)
        for part, mesh in zip(block.parts, meshes, strict=True):
            rows = slice(part.first_triangle, part.first_triangle + part.triangles)
            assert mesh.triangles.shape == whole.positions[rows].shape
            # the same triangles in the same order; another corner may come first
            errors = [
                np.abs(np.roll(mesh.triangles, turn, 1) - whole.positions[rows]).max(axis=(1, 2))
                for turn in range(3)
            ]
            assert np.min(errors, axis=0).max() <= step / 2 * 1.0001 + 1e-5


def test_a_packed_block_reads_like_a_plain_one(scene):
    store = Store()
    near = NearBlocks(scene, store.put)
    for index, block in enumerate(scene.info.blocks):
        data = store.get(near.blob(index))
        packed, other = read_near_block(data), read_near_block(plain(data))
        assert sum(len(primitive.triangles) for primitive in packed) == block.triangles
        for a, b in zip(packed, other, strict=True):
            assert np.array_equal(a.triangles, b.triangles)
            assert np.array_equal(a.positions, b.positions)


@pytest.mark.parametrize(
    "change", [{"mode": "INDICES"}, {"count": 10**9}, {"byteLength": 20}, {"byteStride": 8}]
)
def test_damaged_packing_is_refused(scene, change):
    store = Store()
    root, body = parse(store.get(NearBlocks(scene, store.put).blob(0)))
    for view in root["bufferViews"]:
        if "extensions" in view:
            view["extensions"][PACKED] |= change
    with pytest.raises(BadInputError, match="cannot be read"):
        read_near_block(glb(root, body))


def materials(scene: PreparedScene, store: Store) -> list[dict[str, Any]]:
    near = NearBlocks(scene, store.put)
    found: list[dict[str, Any]] = [{}] * len(scene.info.batches)
    for index, block in enumerate(scene.info.blocks):
        root, _ = parse(store.get(near.blob(index)))
        for part, primitive in zip(block.parts, root["meshes"][0]["primitives"], strict=True):
            material = dict(root["materials"][primitive["material"]])
            material["has_uvs"] = "TEXCOORD_0" in primitive["attributes"]
            for key in ("baseColorTexture", "emissiveTexture"):
                info = material.get(key, material["pbrMetallicRoughness"].get(key))
                if info is not None:
                    texture = root["textures"][info["index"]]
                    uri = root["images"][texture["source"]]["uri"]
                    material[key] = (uri, root["samplers"][texture["sampler"]])
            found[part.batch] = material
    return found


def test_materials(scene):
    store = Store()
    for batch, material in zip(scene.info.batches, materials(scene, store), strict=True):
        assert (
            material.get("alphaMode", "OPAQUE")
            == {
                "opaque": "OPAQUE",
                "mask": "MASK",
                "dither": "BLEND",
            }[batch.alpha]
        )
        assert (material.get("extras") == {"alpha": "dither"}) == (batch.alpha == "dither")
        if batch.alpha == "mask":
            assert material["alphaCutoff"] == batch.cutoff
        assert material.get("doubleSided", False) == batch.double_sided
        assert ("KHR_materials_unlit" in material.get("extensions", {})) == batch.unlit
        assert tuple(material.get("emissiveFactor", (0, 0, 0))) == batch.emissive
        assert material["has_uvs"] == (
            batch.texture is not None or batch.emissive_texture is not None
        )
        for key, index in (
            ("baseColorTexture", batch.texture),
            ("emissiveTexture", batch.emissive_texture),
        ):
            assert (key in material) == (index is not None)
            if index is not None:
                uri, sampler = material[key]
                texture = scene.info.textures[index]
                file = scene.folder / "textures" / texture.file
                assert store.get(uri) == file.read_bytes()
                assert sampler["wrapS"] == {"repeat": 10497, "clamp": 33071}[texture.wrap_u]
                assert sampler["wrapT"] == {"repeat": 10497, "mirror": 33648}[texture.wrap_v]
                assert sampler["magFilter"] == {"linear": 9729, "nearest": 9728}[texture.filter]


def test_vertex_colours_and_coordinates(scene):
    store = Store()
    near = NearBlocks(scene, store.put)
    for index, block in enumerate(scene.info.blocks):
        root, body = parse(store.get(near.blob(index)))
        rows = slice(block.first_vertex, block.first_vertex + block.vertices)
        for primitive in root["meshes"][0]["primitives"]:
            for name, wanted, dtype in (
                ("COLOR_0", scene.colors[rows], "<u2"),
                ("NORMAL", scene.normals[rows, :3], "<i1"),
                ("TEXCOORD_0", np.rint(scene.uvs[rows].astype(float) * 65535), "<u2"),
            ):
                if name not in primitive["attributes"]:
                    continue
                accessor = root["accessors"][primitive["attributes"][name]]
                view = root["bufferViews"][accessor["bufferView"]]
                stored = np.ndarray(
                    wanted.shape,
                    dtype,
                    body,
                    view["byteOffset"],
                    (view["byteStride"], np.dtype(dtype).itemsize),
                )
                assert accessor["normalized"]
                assert np.array_equal(stored, wanted)


def test_large_textures_are_reduced(tmp_path):
    gltf = Gltf()
    large = np.zeros((3, 5000, 3), np.uint8)
    large[:] = (10, 200, 30)
    info = {"index": gltf.texture(large)}
    gltf.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": info}})
    gltf.node(mesh=gltf.mesh(gltf.quad(0, TEXCOORD_0=QUAD_UVS)))
    store = Store()
    NearBlocks(prepared(gltf, tmp_path), store.put).blob(0)
    (data,) = [data for key, data in store.files.items() if key.endswith(".png")]
    with Image.open(io.BytesIO(data)) as image:
        assert image.size == (2048, 1)
        assert image.getpixel((1000, 0)) == (10, 200, 30)


def test_coordinates_beyond_the_picture_stay_floats():
    inside = np.array([[0, 0.5], [1, 0.25]], np.float32)
    packed, fraction = pack_uvs(inside)
    assert fraction
    assert np.abs(packed / 65535 - inside).max() <= 0.5 / 65535
    beyond = inside * 3
    packed, fraction = pack_uvs(beyond)
    assert not fraction
    assert packed is beyond


@given(st.floats(1e-6, 1e6))
def test_steps_are_the_finest_power_of_two(extent):
    step = finest_step(extent)
    assert np.log2(step) % 1 == 0
    assert extent / step <= 65534 < extent / (step / 2)


def test_blocks_share_a_grid(scene):
    common = common_step(scene.info)
    for block in scene.info.blocks:
        rows = slice(block.first_vertex, block.first_vertex + block.vertices)
        positions = np.asarray(scene.positions[rows])
        steps, start, step = quantise(positions, block, common)
        assert step >= common
        assert (np.array(start) / step % 1 == 0).all()
        back = np.array(start) + steps * step
        assert np.abs(back - positions).max() <= step / 2
