"""Zips that are what they say, and zips that are not."""

from __future__ import annotations

import contextlib
import io
import stat
import struct
import zipfile
from pathlib import Path

import pytest
from farfield_core.archives import ArchiveLimits, unpack_model
from farfield_core.errors import SceneRefusedError


def packed(entries: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return data.getvalue()


def unpack(tmp_path: Path, data: bytes, limits: ArchiveLimits | None = None) -> Path:
    archive = tmp_path / "town.zip"
    archive.write_bytes(data)
    return unpack_model(archive, tmp_path / "out", limits)


def refusal(tmp_path: Path, data: bytes, limits: ArchiveLimits | None = None) -> str:
    with pytest.raises(SceneRefusedError) as refused:
        unpack(tmp_path, data, limits)
    sentence = str(refused.value)
    assert sentence.startswith("town.zip cannot be read: ")
    assert sentence.endswith(".")
    assert [p.name for p in tmp_path.rglob("*") if p.is_file()] == ["town.zip"]
    return sentence


GOOD = {
    "town/town.obj": b"mtllib town.mtl\n",
    "town/town.mtl": b"map_Kd maps/wall.png\n",
    "town/maps/wall.png": b"a picture",
    "town/readme.txt": b"left out",
    "__MACOSX/town/._town.obj": b"left out",
}


def test_a_model_and_what_it_names(tmp_path: Path) -> None:
    model = unpack(tmp_path, packed(GOOD))
    assert model == tmp_path / "out/town/town.obj"
    found = {p.relative_to(tmp_path / "out").as_posix(): p.read_bytes()
             for p in (tmp_path / "out").rglob("*") if p.is_file()}  # fmt: skip
    assert found == {name: GOOD[name] for name in list(GOOD)[:3]}


def test_the_highest_model_is_the_one(tmp_path: Path) -> None:
    assert unpack(tmp_path, packed({"a.glb": b"x", "more/b.glb": b"y"})).name == "a.glb"


@pytest.mark.parametrize(
    ("entries", "word"),
    [
        ({}, "no model"),
        ({"a.txt": b"x"}, "no model"),
        ({"a.glb": b"x", "b.obj": b"y"}, "2 models"),
        ({"../a.glb": b"x"}, "leads out"),
        ({"x/../../a.glb": b"x"}, "leads out"),
        ({"/etc/a.glb": b"x"}, "leads out"),
        ({"..\\a.glb": b"x"}, "leads out"),
        ({"C:\\a.glb": b"x"}, "leads out"),
        ({"a.glb": b"x", "x/./b.png": b"y"}, "leads out"),
        ({"a.glb": b"x", "A.glb": b"y"}, "twice"),
        ({"a.glb": b"x", "b" * 300 + ".png": b"y"}, "no plain name"),
        ({"a.glb": b"x", "a\nb.png": b"y"}, "no plain name"),
    ],
)
def test_names(tmp_path: Path, entries: dict[str, bytes], word: str) -> None:
    assert word in refusal(tmp_path, packed(entries))


@pytest.mark.parametrize("mode", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices(tmp_path: Path, mode: int) -> None:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("a.glb", b"x")
        link = zipfile.ZipInfo("passwd.png")
        link.create_system = 3
        link.external_attr = (mode | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    assert "link or a device" in refusal(tmp_path, data.getvalue())


def test_bombs(tmp_path: Path) -> None:
    bomb = packed({"a.glb": bytes(200 << 20)})
    assert len(bomb) < 300_000
    assert "far more" in refusal(tmp_path, bomb)
    small = ArchiveLimits(unpacked=10)
    assert "far more" in refusal(tmp_path, packed({"a.glb": b"x" * 11}), small)
    few = ArchiveLimits(entries=3)
    many = packed({f"{n}.glb": b"" for n in range(4)})
    assert "more than 3 files" in refusal(tmp_path, many, few)


def test_sizes_that_lie(tmp_path: Path) -> None:
    """The contents say less than the entry unpacks to: it is cut there, and its sum is wrong."""
    data = bytearray(packed({"a.glb": bytes(100_000)}))
    for signature, at in ((b"PK\1\2", 24), (b"PK\3\4", 22)):
        start = data.find(signature)
        struct.pack_into("<L", data, start + at, 10)
    with pytest.raises(SceneRefusedError):
        unpack(tmp_path, bytes(data))
    unpacked = tmp_path / "out/a.glb"
    assert not unpacked.exists() or unpacked.stat().st_size <= 10


def test_contents_that_lie(tmp_path: Path) -> None:
    """An end record that claims four thousand million bytes of contents is not believed."""
    data = bytearray(packed({"a.glb": b"x"}))
    at = data.rfind(b"PK\5\6")
    struct.pack_into("<2L", data, at + 12, 0xFFFFFFF0, 0)
    refusal(tmp_path, bytes(data))
    struct.pack_into("<2H", data, at + 8, 0xFFFE, 0xFFFE)
    refusal(tmp_path, bytes(data))


def test_encrypted(tmp_path: Path) -> None:
    data = bytearray(packed({"a.glb": b"x"}))
    for signature, at in ((b"PK\1\2", 8), (b"PK\3\4", 6)):
        data[data.find(signature) + at] |= 1
    assert "encrypted" in refusal(tmp_path, bytes(data))


def test_every_truncation_is_refused(tmp_path: Path) -> None:
    data = packed(GOOD)
    for cut in range(0, len(data), 7):
        with pytest.raises(SceneRefusedError):
            unpack(tmp_path, data[:cut])


def test_flipped_bytes_stay_inside(tmp_path: Path) -> None:
    data = packed(GOOD)
    for place in range(len(data)):
        changed = bytearray(data)
        changed[place] ^= 0xFF
        folder = tmp_path / str(place)
        folder.mkdir()
        with contextlib.suppress(SceneRefusedError):
            unpack(folder, bytes(changed))
    outside = [p for p in tmp_path.rglob("*") if p.is_file()
               and p.parent.parent == tmp_path and p.name != "town.zip"]  # fmt: skip
    assert outside == []
