"""Objects that repeat: found, baked once, and said in near blocks which triangles are whose."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from farfield_core import format as walk_format
from farfield_core.export import siblings
from farfield_core.scene import PreparedScene
from farfield_worker.near import NearBlocks
from farfield_worker.objects import shapes
from farfield_worker.objects.error import measure
from farfield_worker.objects.fields import bake_fields
from farfield_worker.prepare.repeats import similarities
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.objects.test_true import mesh_of
from tests.unit.prepare.build import Gltf, prepared

Floats = NDArray[np.float64]
COPIES = 10


def turned(quaternion: Floats, points: Floats) -> Floats:
    """Points (n, 3) turned by a unit quaternion x, y, z, w."""
    axis, w = quaternion[:3], quaternion[3]
    return np.asarray(points + 2 * np.cross(axis, np.cross(axis, points) + w * points))


@given(
    q=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.hypot.reduce(q) > 0.1),
    scale=st.floats(0.01, 100),
)
def test_turns_and_even_scales_are_told_from_other_maps(q: tuple[float, ...], scale: float) -> None:
    wanted = np.array(q) / np.linalg.norm(q)
    turn = turned(wanted, np.eye(3)).T
    mirror, stretch = np.diag([1.0, 1.0, -1.0]), np.diag([1.0, 1.01, 1.0])
    maps = scale * np.stack([turn, turn @ mirror, turn @ stretch, 0 * turn])
    even, scales, turns = similarities(maps)
    assert even.tolist() == [True, False, False, False]
    assert scales[0] == pytest.approx(scale)
    np.testing.assert_allclose(turned(turns[0], np.eye(3)).T, turn, atol=1e-6)


def grove(folder: Path) -> PreparedScene:
    """Pears of two materials that repeat, one of them mirrored; a few stones; a ground."""
    gltf = Gltf()
    ball = trimesh.creation.icosphere(subdivisions=3)

    def primitive(points: Floats, material: int) -> dict[str, Any]:
        return {
            "attributes": {"POSITION": gltf.accessor(points.astype("f4"))},
            "indices": gltf.accessor(ball.faces.astype("u2").ravel()),
            "material": material,
        }

    for colour in ([0.2, 0.6, 0.1, 1], [0.5, 0.3, 0.1, 1]):
        gltf.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": colour}})
    gltf.root["materials"][1]["doubleSided"] = True
    pear = gltf.mesh(
        primitive(ball.vertices * [1, 1.5, 1], 0),
        primitive(0.5 * ball.vertices + [0.3, 1.8, 0], 1),
    )
    stone = gltf.mesh(primitive(ball.vertices, 1))
    rng = np.random.default_rng(3)
    for n in range(COPIES):
        q = rng.normal(size=4)
        gltf.node(
            mesh=pear,
            translation=[6.0 * n, 0, 3.0 * (n % 2)],
            rotation=(q / np.linalg.norm(q)).tolist(),
            scale=[0.5 + 0.2 * n] * 3,
        )
    gltf.node(mesh=pear, translation=[0, 20, 0], scale=[-1, 1, 1])
    gltf.node(mesh=pear, translation=[5, 20, 0], scale=[1, 2, 1])
    for n in range(3):
        gltf.node(mesh=stone, translation=[4.0 * n, -20, 0])
    gltf.node(mesh=gltf.mesh(gltf.quad(0)), translation=[0, -30, 0], scale=[90, 90, 1])
    return prepared(gltf, folder)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> PreparedScene:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shapes, "RESOLUTIONS", (64,))
        return grove(tmp_path_factory.mktemp("grove"))


def test_every_copy_is_the_object_moved_turned_and_scaled(scene: PreparedScene) -> None:
    repeats = scene.repeats
    assert repeats is not None
    assert scene.owners is not None
    assert len(repeats.shapes) == 1
    assert repeats.shape == (0,) * COPIES
    owners = np.asarray(scene.owners).ravel()
    assert (owners >= 0).sum() == 2 * 1280 * COPIES
    corners = scene.positions[scene.triangles].astype(np.float64) + scene.origin

    def middles(copy: int) -> Floats:
        return np.asarray(corners[owners == copy].mean(axis=1))

    first = middles(0) - np.array(repeats.places[0][:3])
    assert repeats.places[0][3] == pytest.approx(1)
    for copy in range(COPIES):
        *place, scale = repeats.places[copy]
        expected = turned(np.array(repeats.turns[copy]), first) * scale + place
        some = middles(copy)[::16]
        from_each = np.linalg.norm(some[:, None] - expected, axis=2).min(axis=1)
        assert from_each.max() < 1e-3 * scale


def test_the_object_file_keeps_its_format(scene: PreparedScene) -> None:
    assert scene.repeats is not None
    (name,) = scene.repeats.shapes
    document = walk_format.load((scene.folder / "objects" / name).read_bytes())
    walk_format.validate("object", document)
    assert document["triangles"] == 2560
    assert document["silhouette"] < 0.03
    assert (scene.folder / "objects" / document["image"]).is_file()


def read_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def test_near_blocks_say_whose_each_triangle_is(scene: PreparedScene) -> None:
    repeats, files = scene.repeats, dict[str, bytes]()
    assert repeats is not None
    assert scene.owners is not None
    near = NearBlocks(scene, files.__setitem__)
    seen = 0
    for index, block in enumerate(scene.info.blocks):
        name = near.blob(index)
        root, body = read_glb(files[f"blobs/near/{name}"])
        columns = root.get("extras", {}).get("objects", {})
        for part, primitive in zip(block.parts, root["meshes"][0]["primitives"], strict=True):
            rows = slice(part.first_triangle, part.first_triangle + part.triangles)
            wanted = np.asarray(scene.owners[rows]).ravel()
            if not columns:
                assert (wanted == -1).all()
                assert "extras" not in primitive
                continue
            accessor = root["accessors"][primitive["extras"]["owners"]]
            view = root["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            numbers = np.frombuffer(body, "<u2", accessor["count"], start)
            places = np.array([*columns["places"], *[np.nan] * 4]).reshape(-1, 4)
            of_copy = np.array([*repeats.places, [np.nan] * 4])
            np.testing.assert_array_equal(places[numbers.astype(int) - 1], of_copy[wanted])
            seen += int((wanted >= 0).sum())
    assert seen == 2 * 1280 * COPIES
    # What is exported with a block: the object, and its picture.
    (shape,) = repeats.shapes
    blocks = [name for name in files if name.endswith(".glb")]
    assert any(siblings(name, files[name]) == [shape] for name in blocks)
    (picture,) = siblings(shape, files[f"blobs/near/{shape}"])
    assert files[f"blobs/near/{picture}"].startswith(b"\x89PNG")


def test_a_steep_sheet_has_no_holes() -> None:
    # rises by three texels from column to column
    x, z = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 3, 9), indexing="ij")
    y = np.abs(z - 1.5) / 1.5
    p = np.stack([y, x, z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    sheet = np.concatenate(
        [np.stack([a, b, c], -2).reshape(-1, 3, 3), np.stack([a, c, d], -2).reshape(-1, 3, 3)]
    )
    mesh = mesh_of(sheet)
    error = measure(bake_fields(mesh, 48, 1), mesh, 48, 8, 1.5)
    assert error.holes < 0.01
    assert error.silhouette < 0.1
