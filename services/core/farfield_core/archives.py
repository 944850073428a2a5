"""A zip with a model and its textures: unpacked only where nothing in it reaches for more.

Everything is decided from the table of contents, before a byte is unpacked: names that lead
elsewhere, links, encrypted entries, and more bytes than allowed refuse the whole archive. What a
model cannot use, such as a read-me, is left out.
"""

from __future__ import annotations

import errno
import shutil
import stat
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NoReturn

from farfield_core.errors import SceneRefusedError
from farfield_core.sources import SUFFIXES, is_model

#: files that a model may refer to
_BESIDE = (
    *(".bin", ".mtl", ".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".gif", ".tif", ".tiff"),
    *(".ktx2", ".basis", ".dds"),
)
_CHUNK = 1 << 20
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
#: end of central directory, its zip64 locator and record (APPNOTE 4.3.14 to 4.3.16)
_END = struct.Struct("<4s4H2LH")
_LOCATOR = struct.Struct("<4sLQL")
_END64 = struct.Struct("<4sQ2H2L4Q")


@dataclass(frozen=True)
class ArchiveLimits:
    """What an archive may come to.

    Attributes:
        entries: files and folders.
        unpacked: bytes of all files.
        ratio: unpacked bytes for each packed byte, beyond the first 64 MiB.
        contents: bytes of the table of contents, which is held in memory.
    """

    entries: int = 20_000
    unpacked: int = 64 << 30
    ratio: float = 150.0
    contents: int = 16 << 20


def is_archive(name: str) -> bool:
    """Whether a file of this name is taken for an archive."""
    return PurePosixPath(name).suffix.lower() == ".zip"


def unpack_model(archive: Path, into: Path, limits: ArchiveLimits | None = None) -> Path:
    """Unpack a model and what it may need into the empty folder `into`; returns the model's file.

    Raises SceneRefusedError, and OSError where there is no space.
    """
    limits = limits or ArchiveLimits()
    try:
        _check_contents(archive, limits)
        with zipfile.ZipFile(archive) as opened:
            entries = _wanted(archive.name, opened, limits)
            model = _the_model(archive.name, list(entries))
            for name, info in entries.items():
                _unpack(opened, info, into / name)
    except (zipfile.BadZipFile, zlib.error, EOFError, struct.error, NotImplementedError) as error:
        _refuse(archive.name, f"it is damaged or no zip ({' '.join(str(error).split())[:100]})")
    except OSError as error:
        if error.errno != errno.EINVAL:  # a place before the file's beginning
            raise
        _refuse(archive.name, "it is damaged or no zip")
    except (ValueError, RuntimeError, OverflowError) as error:
        _refuse(archive.name, f"its contents make no sense ({' '.join(str(error).split())[:100]})")
    return into / model


def _check_contents(archive: Path, limits: ArchiveLimits) -> None:
    """Refuse a table of contents that would not fit into memory: zipfile reads all of it."""
    size = archive.stat().st_size
    with archive.open("rb") as file:
        file.seek(max(0, size - _END.size - 65535 - _LOCATOR.size))
        start = file.tell()
        tail = file.read()
        at = tail.rfind(b"PK\5\6")
        if at < 0 or at + _END.size > len(tail):
            _refuse(archive.name, "it is damaged or no zip")
        *_, count, length, _offset, _comment = _END.unpack_from(tail, at)
        locator = at - _LOCATOR.size
        if locator >= 0 and tail[locator : locator + 4] == b"PK\6\7":
            _, _, where, _ = _LOCATOR.unpack_from(tail, locator)
            if where + _END64.size > start + at:
                _refuse(archive.name, "it is damaged or no zip")
            file.seek(where)
            record = _END64.unpack(file.read(_END64.size))
            count, length = max(count % 0xFFFF, record[7]), max(length % 0xFFFFFFFF, record[8])
    if count > limits.entries or length > limits.contents:
        _refuse(archive.name, f"it holds more than {limits.entries} files; send fewer")


def _wanted(
    archive: str, opened: zipfile.ZipFile, limits: ArchiveLimits
) -> dict[str, zipfile.ZipInfo]:
    """Entries to unpack by their path; the rest are looked at and left out."""
    infos = opened.infolist()
    if len(infos) > limits.entries:
        _refuse(archive, f"it holds more than {limits.entries} files; send fewer")
    entries: dict[str, zipfile.ZipInfo] = {}
    seen: set[str] = set()
    total = packed = 0
    for info in infos:
        name = _plain(archive, info)
        if info.is_dir():
            continue
        total, packed = total + info.file_size, packed + info.compress_size
        if total > limits.unpacked or total > (64 << 20) + limits.ratio * packed:
            _refuse(archive, "it unpacks to far more than it says or than is allowed")
        if name.casefold() in seen:
            _refuse(archive, f"it holds {name[:80]!r} twice")
        seen.add(name.casefold())
        suffix = PurePosixPath(name).suffix.lower()
        if name.startswith("__MACOSX/") or suffix not in (*SUFFIXES, *_BESIDE):
            continue
        if info.flag_bits & 0x1:
            _refuse(archive, "it is encrypted; send it without a password")
        if info.compress_type not in _METHODS:
            _refuse(archive, "it is packed in a way that is not read; use plain zip (deflate)")
        entries[name] = info
    return entries


def _plain(archive: str, info: zipfile.ZipInfo) -> str:
    """The entry's path if it lies inside the archive and is a plain file or folder."""
    # zipfile cuts names at a NUL; what was written counts
    name = info.orig_filename.replace("\\", "/")
    parts = name.rstrip("/").split("/")
    odd = "\0" in name or not name.isprintable() or len(name) > 1000 or ":" in parts[0]
    if odd or name.startswith("/") or any(p in ("", ".", "..") or len(p) > 200 for p in parts):
        _refuse(archive, f"it holds {name[:80]!r}, which leads out of it or is no plain name")
    mode = info.external_attr >> 16
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
        _refuse(archive, f"it holds {name[:80]!r}, which is a link or a device")
    return name


def _the_model(archive: str, names: list[str]) -> str:
    """The one model of an archive; of several, the one that lies highest."""
    models = [name for name in names if is_model(name)]
    if not models:
        _refuse(archive, f"it holds no model; put one of {', '.join(SUFFIXES)} into it")
    highest = min(name.count("/") for name in models)
    models = sorted(name for name in models if name.count("/") == highest)
    if len(models) > 1:
        _refuse(archive, f"it holds {len(models)} models ({', '.join(models)[:120]}); send one")
    return models[0]


def _unpack(opened: zipfile.ZipFile, info: zipfile.ZipInfo, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    # zipfile stops at the size that the contents give, and checks the sum
    with opened.open(info) as packed, target.open("xb") as out:
        shutil.copyfileobj(packed, out, _CHUNK)
    if target.stat().st_size != info.file_size:
        raise zipfile.BadZipFile(f"{info.filename} has another size than it says")


def _refuse(archive: str, cause: str) -> NoReturn:
    raise SceneRefusedError(f"{archive} cannot be read: {cause.rstrip('.')}.")
