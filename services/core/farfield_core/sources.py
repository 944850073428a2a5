"""Model files as they come: what belongs to one, and what it is called."""

from __future__ import annotations

import hashlib
import json
import mmap
import re
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from farfield_core.errors import SceneRefusedError

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")

_MTLLIB = re.compile(rb"(?m)^[ \t]*mtllib[ \t]+([^\r\n]+)")
_MAP = re.compile(r"(?mi)^[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+([^\r\n]+)")


def is_model(name: str) -> bool:
    """Whether a file of this name can be a scene."""
    return PurePosixPath(name).suffix.lower() in SUFFIXES


def source_files(model: Path) -> dict[str, Path]:
    """The model and the files it names that exist, by path relative to its folder; itself first.

    Files outside the model's folder are left out: the store keeps a scene's folder only. Raises
    SceneRefusedError for what is no model file.
    """
    if not is_model(model.name):
        raise SceneRefusedError(
            f"{model.name} cannot be read as a model; give one of {', '.join(SUFFIXES)}."
        )
    if not model.is_file():
        raise SceneRefusedError(f"There is no model file {model}.")
    files = {model.name: model}
    for name in _named(model):
        inside = _inside(model.parent, name)
        if inside is not None:
            files.setdefault(inside.relative_to(model.parent).as_posix(), inside)
    return files


def scene_id(files: dict[str, Path]) -> str:
    """Hash of a source's bytes, 16 hex digits; the model's own name does not matter."""
    digest = hashlib.sha256()
    model, *others = files
    digest.update(PurePosixPath(model).suffix.lower().encode())
    for name in [model, *sorted(others)]:
        with files[name].open("rb") as file:
            content = hashlib.file_digest(file, "sha256")
        digest.update(content.digest())
        if name != model:
            digest.update(name.encode())
    return digest.hexdigest()[:16]


def _inside(folder: Path, name: str) -> Path | None:
    """The file `name` in `folder`, None if it is not there or lies elsewhere."""
    path = folder / name.replace("\\", "/")
    try:
        found = path.resolve().is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError):  # such as a name too long, or with a NUL in it
        return None
    return folder / path.resolve().relative_to(folder.resolve()) if found else None


def _named(model: Path) -> Iterator[str]:
    """Names of files that a model refers to, as written in it."""
    suffix = model.suffix.lower()
    if suffix == ".gltf":
        yield from _gltf_uris(model)
    elif suffix == ".obj" and model.stat().st_size:
        with model.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            libraries = {m[1].strip().decode("utf-8", "replace") for m in _MTLLIB.finditer(text)}
        for library in sorted(libraries):
            yield library
            path = _inside(model.parent, library)
            if path is not None:
                yield from _map_names(path.read_text(encoding="utf-8", errors="replace"))


def _map_names(mtl: str) -> Iterator[str]:
    """Texture names of a material library; options such as `-bm 1` may stand before a name."""
    for match in _MAP.finditer(mtl):
        words = match[1].strip().split()
        # a name may hold spaces: every tail may be it, and only a file that exists is taken
        for first in range(len(words)):
            yield " ".join(words[first:])


def _gltf_uris(model: Path) -> Iterator[str]:
    try:
        document = json.loads(model.read_bytes())
        parts: Iterable[object] = [*document.get("buffers", []), *document.get("images", [])]
    except (ValueError, RecursionError, AttributeError, TypeError) as error:
        raise SceneRefusedError(f"{model.name} is not a glTF file: {error}.") from None
    for part in parts:
        uri = part.get("uri") if isinstance(part, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            yield unquote(uri)
