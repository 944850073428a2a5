"""Files that are damaged, that lie or that reach for what is not theirs: always one sentence."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from farfield_core.errors import SceneRefusedError
from farfield_worker.prepare import Limits, prepare
from farfield_worker.prepare.command import main
from farfield_worker.prepare.read import READERS, read_model

from tests.unit.prepare.build import (
    QUAD_UVS,
    UP_Z,
    Gltf,
    flat_color,
    one_quad,
    png,
    prepared,
)
from tests.unit.prepare.test_gltf_compression import draco_quad, meshopt_quad
from tests.unit.prepare.test_obj import SQUARE
from tests.unit.prepare.test_ply_stl import ASCII_PLY


def rich_glb() -> bytes:
    gltf = Gltf()
    info = {"index": gltf.texture(flat_color(1, 2, 3, 200))}
    gltf.add(
        "materials",
        {"pbrMetallicRoughness": {"baseColorTexture": info}, "alphaMode": "BLEND"},
    )
    gltf.node(mesh=gltf.mesh(gltf.quad(0, TEXCOORD_0=QUAD_UVS, NORMAL=UP_Z)), scale=[1, 2, 1])
    gltf.node(mesh=gltf.mesh(meshopt_quad(gltf)), rotation=[0, 0, 0, 1])
    gltf.node(mesh=gltf.mesh(draco_quad(gltf)))
    return gltf.glb()


def samples() -> dict[str, bytes]:
    box = trimesh.creation.box()
    return {
        "rich.glb": rich_glb(),
        "quad.obj": (SQUARE + "usemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf -1 -2 -3\n").encode(),
        "text.ply": ASCII_PLY.encode(),
        "bytes.ply": trimesh.exchange.ply.export_ply(box),
        "bytes.stl": box.export(file_type="stl"),
        "text.stl": box.export(file_type="stl_ascii").encode(),
    }


def attempt(path: Path) -> str:
    """Read a file; how it went. Anything but success or a refusal fails the test by itself."""
    try:
        read_model(path, Limits(triangles=100_000, decoded_bytes=1 << 24, pixels=1 << 20))
    except SceneRefusedError as error:
        sentence = str(error)
    else:
        return "read"
    assert sentence.startswith(path.name)
    assert sentence.endswith(".")
    assert "\n" not in sentence
    return "refused"


@pytest.mark.parametrize("name", list(samples()))
def test_whole_samples_are_read(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(samples()[name])
    assert attempt(path) == "read"


@pytest.mark.parametrize("name", list(samples()))
def test_truncated_files(tmp_path, name):
    data = samples()[name]
    path = tmp_path / name
    outcomes = []
    for cut in np.linspace(0, len(data) - 1, 80).astype(int):
        path.write_bytes(data[:cut])
        outcomes.append(attempt(path))
    assert outcomes[0] == "refused"
    if name in ("rich.glb", "bytes.ply", "bytes.stl"):
        assert set(outcomes) == {"refused"}


@pytest.mark.parametrize("name", list(samples()))
def test_flipped_bytes(tmp_path, name):
    data = samples()[name]
    path = tmp_path / name
    random = np.random.default_rng(7)
    for _ in range(150):
        damaged = bytearray(data)
        for place in random.integers(0, len(data), random.integers(1, 5)):
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        attempt(path)


def mutate(random: np.random.Generator, value: object) -> object:
    """Replace one spot of a JSON tree with something unexpected."""
    odd = [None, -1, 2**40, 1e308, "x", [], {}, True, 0, [[]], float("nan"), {"x": 1}]
    if isinstance(value, dict) and value and random.random() < 0.85:
        key = list(value)[random.integers(len(value))]
        return value | {key: mutate(random, value[key])}
    if isinstance(value, list) and value and random.random() < 0.85:
        place = int(random.integers(len(value)))
        return [*value[:place], mutate(random, value[place]), *value[place + 1 :]]
    return odd[random.integers(len(odd))]


def test_odd_json(tmp_path):
    data = rich_glb()
    (length,) = struct.unpack("<I", data[12:16])
    root, rest = json.loads(data[20 : 20 + length]), data[20 + length :]
    path = tmp_path / "odd.glb"
    random = np.random.default_rng(3)
    refused = 0
    for _ in range(400):
        text = json.dumps(mutate(random, root)).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
        path.write_bytes(head + text + rest)
        refused += attempt(path) == "refused"
    assert refused > 200


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 2_000_000_000}, "beyond its buffer view"),
        ({"byteOffset": 1 << 40}, "beyond its buffer view"),
        ({"count": -1}, "a count is -1"),
        ({"componentType": 1}, "unknown type"),
        ({"bufferView": 99}, "bufferViews 99"),
        ({"bufferView": None, "sparse": None}, "bufferViews None"),
    ],
)
def test_accessors_that_lie(tmp_path, change, message):
    gltf = one_quad()
    gltf.root["accessors"][0] |= change
    with pytest.raises(SceneRefusedError, match=message):
        prepared(gltf, tmp_path)


def test_sparse_accessor_out_of_nothing(tmp_path):
    gltf = one_quad()
    accessor = gltf.root["accessors"][0]
    del accessor["bufferView"]
    accessor |= {"count": 2_000_000_000, "sparse": {"count": 0}}
    with pytest.raises(SceneRefusedError, match="unpack to more"):
        prepared(gltf, tmp_path)


def test_indices_beyond_the_vertices(tmp_path):
    gltf = one_quad()
    accessor = gltf.accessor(np.array([0, 1, 4], "u2"))
    gltf.root["meshes"][0]["primitives"][0]["indices"] = accessor
    with pytest.raises(SceneRefusedError, match="beyond its vertices"):
        prepared(gltf, tmp_path)


def test_too_many_triangles(tmp_path):
    gltf = one_quad()
    for _ in range(20):
        gltf.node(mesh=0)
    path = gltf.write(tmp_path)
    with pytest.raises(SceneRefusedError, match="more than 10 triangles"):
        prepare(path, tmp_path / "out", "s", "n", Limits(triangles=10))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin",
        "..%2Fsecret.bin",
        "/etc/passwd",
        "file:///etc/passwd",
        "http://example.com/x.bin",
        "link.bin",
        "sub/../../secret.bin",
        "..\\secret.bin",
    ],
)
def test_files_outside_the_folder(tmp_path, uri):
    folder = tmp_path / "upload"
    folder.mkdir()
    gltf = one_quad()
    (tmp_path / "secret.bin").write_bytes(bytes(gltf.body))
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    root = gltf.root | {"buffers": [{"uri": uri, "byteLength": len(gltf.body)}]}
    path = folder / "model.gltf"
    path.write_text(json.dumps(root))
    # a backslash is an ordinary character in a URI: that file merely does not exist
    message = "is missing" if "\\" in uri else "not a file in its own folder"
    with pytest.raises(SceneRefusedError, match=message):
        prepared(path, tmp_path)


def test_pictures_outside_the_folder(tmp_path):
    folder = tmp_path / "upload"
    folder.mkdir()
    (tmp_path / "secret.png").write_bytes(png(flat_color(1, 1, 1)))
    gltf = Gltf()
    gltf.add("images", {"uri": "../secret.png"})
    gltf.add("textures", {"source": 0})
    surface = {"baseColorTexture": {"index": 0}}
    gltf.add("materials", {"pbrMetallicRoughness": surface})
    gltf.node(mesh=gltf.mesh(gltf.quad(0, TEXCOORD_0=QUAD_UVS)))
    with pytest.raises(SceneRefusedError, match="not a file in its own folder"):
        prepared(gltf.write(folder), tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("model.fbx", b"", "suffix '.fbx' is not one of .glb, .gltf, .obj, .ply, .stl"),
        ("model", b"", "suffix"),
        ("empty.glb", b"", "too short"),
        ("empty.obj", b"", "holds no triangles"),
        ("empty.stl", b"", "too short"),
        ("one.gltf", b'{"asset": {"version": "1.0"}}', "not glTF version 2"),
        ("bare.gltf", b'{"asset": {"version": "2.0"}}', "holds no triangles"),
        ("list.gltf", b"[]", "not a glTF"),
        ("deep.gltf", b"[" * 100_000, "JSON is damaged"),
        ("new.gltf", b'{"asset":{"version":"2.0"},"extensionsRequired":["EXT_x"]}', "EXT_x"),
    ],
)
def test_other_refusals(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SceneRefusedError, match=message) as caught:
        prepared(path, tmp_path)
    assert name in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(SceneRefusedError, match="no such file"):
        prepared(tmp_path / "none.glb", tmp_path)


def test_every_format_is_tried():
    assert {Path(name).suffix for name in samples()} | {".gltf"} == set(READERS)


def test_a_failed_preparation_leaves_the_old_scene(tmp_path):
    scene = prepared(one_quad(), tmp_path)
    (tmp_path / "model.glb").write_bytes(b"glTF")
    with pytest.raises(SceneRefusedError):
        prepared(tmp_path / "model.glb", tmp_path)
    assert (scene.folder / "scene.json").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["model.glb", "prepared"]


def test_command(tmp_path, capsys):
    path = one_quad().write(tmp_path)
    arguments = ["--source", str(path), "--out", str(tmp_path / "out"), "--id", "a", "--name", "b"]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert json.loads(out.splitlines()[-1]) == {"ok": True, "triangles": 2, "notes": []}
    assert "reading" in err
    path.write_bytes(b"nothing that could be read")
    assert main(arguments) == 3
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert last == {"ok": False, "error": "model.glb cannot be read: it is not a GLB."}


def test_command_says_when_it_cannot_write(tmp_path, capsys):
    path = one_quad().write(tmp_path)
    out = path / "below a file"
    assert main(["--source", str(path), "--out", str(out), "--id", "a", "--name", "b"]) == 1
    assert "cannot be written" in json.loads(capsys.readouterr().out)["error"]


def test_memory_limit(tmp_path):
    # a few bytes that rightly ask for more than a gigabyte
    gltf = one_quad()
    accessor = gltf.root["accessors"][0]
    del accessor["bufferView"]
    nothing = {"bufferView": gltf.view(bytes(12)), "componentType": 5125}
    accessor |= {"count": 100_000_000, "sparse": {"count": 1, "indices": nothing}}
    accessor["sparse"]["values"] = {"bufferView": nothing["bufferView"]}
    path = gltf.write(tmp_path)
    command = [sys.executable, "-m", "farfield_worker", "prepare", "--source", str(path)]
    command += ["--out", str(tmp_path / "out"), "--id", "a", "--name", "b", "--memory-mb", "800"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    assert "needs more memory" in last["error"]
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == [path]
