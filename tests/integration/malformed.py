"""Models that are damaged, lie, reach for what is not theirs or want too much: over 700 of them.

`python malformed.py FOLDER` prepares every case there, without pictures, and tells of each in a
line how it went and how long it took.
"""

from __future__ import annotations

import io
import json
import stat
import struct
import sys
import time
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh


def whole() -> dict[str, bytes]:
    """A small good model of each kind."""
    box = trimesh.creation.box()
    textured = trimesh.creation.box()
    textured.visual = trimesh.visual.TextureVisuals(
        uv=np.zeros((8, 2)), image=_picture(), material=None
    )
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("town/box.obj", "mtllib box.mtl\nusemtl m\n" + box.export(file_type="obj"))
        archive.writestr("town/box.mtl", "newmtl m\nKd 1 0 0\n")
    return {
        "box.glb": bytes(textured.export(file_type="glb")),
        "box.obj": str(box.export(file_type="obj")).encode(),
        "binary.ply": bytes(box.export(file_type="ply")),
        "text.ply": bytes(box.export(file_type="ply", encoding="ascii")),
        "box.stl": bytes(box.export(file_type="stl")),
        "box.zip": packed.getvalue(),
    }


def cases() -> Iterator[tuple[str, str, bytes]]:
    """Every case: what it is, its file name, its bytes."""
    random = np.random.default_rng(500)
    for name, data in whole().items():
        for percent in range(100):
            yield f"{name} cut at {percent} %", name, data[: len(data) * percent // 100]
        for number in range(25):
            flipped = bytearray(data)
            for place in random.integers(0, len(data), 1 + number % 5):
                flipped[place] ^= 1 << int(random.integers(8))
            yield f"{name} flipped {number}", name, bytes(flipped)
    yield from _liars()
    yield from _reaching()
    yield from _bombs()


def _picture() -> object:
    from PIL import Image

    return Image.new("RGB", (4, 4), (200, 30, 30))


def glb(document: object, binary: bytes = b"") -> bytes:
    """A GLB of a JSON document and a binary chunk."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _triangle(count: int, **view: object) -> dict[str, object]:
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36, **view}],
        "buffers": [{"byteLength": 36}],
    }


def _liars() -> Iterator[tuple[str, str, bytes]]:
    """Counts that lie."""
    for count in (2_000_000_000, 2**31, 2**32, 2**63, -1):
        head = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\n"
            f"property float y\nproperty float z\nelement face {count}\n"
            "property list uchar int vertex_indices\nend_header\n"
        )
        yield f"PLY of {count} vertices", "lie.ply", head.encode() + bytes(64)
        yield f"GLB of {count} vertices", "lie.glb", glb(_triangle(count), bytes(36))
    yield "STL of four thousand million triangles", "lie.stl", bytes(80) + b"\xff" * 4 + bytes(50)
    yield "GLB buffer view beyond", "view.glb", glb(_triangle(3, byteOffset=2**40), bytes(36))
    sparse = _triangle(3)
    sparse["accessors"] = [
        {"componentType": 5126, "count": 2**30, "type": "VEC3", "sparse": {"count": 2**30}}
    ]
    yield "GLB sparse of nothing", "sparse.glb", glb(sparse)
    loop = _triangle(3)
    loop["nodes"] = [{"children": [1]}, {"children": [0], "mesh": 0}]
    yield "GLB whose nodes go round", "loop.glb", glb(loop, bytes(36))
    fan: dict[str, object] = _triangle(3)
    fan["nodes"] = [{"children": [n + 1, n + 1]} for n in range(60)] + [{"mesh": 0}]
    yield "GLB of 2**60 instances", "fan.glb", glb(fan, bytes(36))
    yield (
        "GLB of deep JSON",
        "deep.glb",
        glb({"asset": {"version": "2.0"}}).replace(b'"2.0"', b"[" * 4 + b"]" * 1),
    )
    deep = b'{"a":' * 100_000
    yield "glTF of deep JSON", "deep.gltf", deep
    yield "OBJ of far indices", "far.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4000000000\n"
    yield "OBJ of odd numbers", "odd.obj", b"v nan inf 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    yield "OBJ of one long line", "long.obj", b"f " + b"1 " * 2_000_000
    yield "nothing", "nothing.glb", b""


def _reaching() -> Iterator[tuple[str, str, bytes]]:
    """Addresses and files outside the upload."""
    for uri in (
        "https://example.org/a.bin",
        "file:///etc/passwd",
        "/etc/passwd",
        "../../../../../../etc/passwd",
        "..%2f..%2f..%2fetc%2fpasswd",
        "C:\\a.bin",
    ):
        document = _triangle(3)
        document["buffers"] = [{"byteLength": 36, "uri": uri}]
        yield f"glTF buffer at {uri}", "reach.gltf", json.dumps(document).encode()
        yield f"GLB buffer at {uri}", "reach.glb", glb(document)
        text = f"mtllib {uri}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        yield f"OBJ library at {uri}", "reach.obj", text.encode()
        yield "zip entry at " + uri, "reach.zip", _zip({uri: b"x", "a.obj": b"v 0 0 0\n"})
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("a.obj", "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        link = zipfile.ZipInfo("b.mtl")
        link.create_system = 3
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    yield "zip with a link", "link.zip", data.getvalue()


def _bombs() -> Iterator[tuple[str, str, bytes]]:
    """Small files that want much."""
    yield "zip bomb", "bomb.zip", _zip({"a.glb": bytes(300 << 20)})
    for name, size in (("large", (60_000, 60_000)), ("huge", (2**31 - 1, 2**31 - 1))):
        document = _triangle(3)
        document |= {
            "images": [{"bufferView": 1, "mimeType": "image/png"}],
            "textures": [{"source": 0}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        }
        picture = _png_header(*size)
        document["bufferViews"] = [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": len(picture)},
        ]
        document["buffers"] = [{"byteLength": 36 + len(picture)}]
        document["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]
        corners = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
        yield f"image bomb, {name}", "image.glb", glb(document, corners + picture)


def _zip(entries: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return data.getvalue()


def _png_header(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    body = zlib.compress(bytes(1 << 20), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def main(folder: Path) -> None:
    """Prepare every case."""
    from farfield_core.archives import is_archive, unpack_model
    from farfield_core.errors import SceneRefusedError
    from farfield_worker.prepare import prepare

    # compiled before the clock runs
    warm = folder / "warm.stl"
    warm.write_bytes(whole()["box.stl"])
    prepare(warm, folder / "warm", "a" * 16, "warm", pictures=False)
    for number, (what, name, data) in enumerate(cases()):
        place = folder / str(number)
        place.mkdir()
        model = place / name
        model.write_bytes(data)
        begun = time.perf_counter()
        try:
            if is_archive(name):
                (place / "unpacked").mkdir()
                model = unpack_model(model, place / "unpacked")
            info = prepare(model, place / "out", "a" * 16, "case", pictures=False)
            outcome, sentence = "ready", str(info.triangles)
        except SceneRefusedError as error:
            outcome, sentence = "refused", str(error)
        seconds = time.perf_counter() - begun
        said = {"what": what, "outcome": outcome, "sentence": sentence, "seconds": seconds}
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
