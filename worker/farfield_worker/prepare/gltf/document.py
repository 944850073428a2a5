"""The containers of glTF 2.0 (specification, sections 3.6 and 4.4): JSON, GLB chunks, buffers."""

from __future__ import annotations

import base64
import binascii
import json
import mmap
import struct
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.limits import Limits, refuse

Bytes = NDArray[np.uint8]
Json = dict[str, Any]

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


class Document:
    """A glTF's JSON and, on demand, its buffers; nothing is read twice.

    Attributes:
        json: the root object.
        notes: what readers of its parts left out or guessed.
    """

    def __init__(self, folder: ModelFolder, limits: Limits) -> None:
        self.folder = folder
        self.limits = limits
        self.notes: list[str] = []
        self._decoded = 0
        self._buffers: dict[int, Bytes] = {}
        whole = map_file(folder.model)
        self._bin: Bytes | None = None
        if folder.model.suffix.lower() == ".glb" or whole[:4].tobytes() == b"glTF":
            text = self._split(whole)
        else:
            text = whole
        if len(text) > limits.json_bytes:
            self.refuse("its JSON is too large")
        try:
            root = json.loads(text.tobytes().rstrip(b"\0"))
        except (UnicodeDecodeError, ValueError, RecursionError):
            self.refuse("its JSON is damaged")
        if not isinstance(root, dict) or not isinstance(root.get("asset"), dict):
            self.refuse("it is not a glTF")
        if not str(root["asset"].get("version", "")).startswith("2."):
            self.refuse("it is not glTF version 2")
        self.json: Json = root

    def refuse(self, cause: str) -> NoReturn:
        """Raise SceneRefusedError in this document's name."""
        refuse(self.folder.name, cause)

    def note(self, text: str) -> None:
        """Remember a note, once."""
        if text not in self.notes:
            self.notes.append(text)

    def charge(self, size: int) -> None:
        """Account for `size` bytes that data unpacks to; refuses once they are too many."""
        self._decoded += size
        if size < 0 or self._decoded > self.limits.decoded_bytes:
            self.refuse("its data would unpack to more than is allowed")

    def item(self, kind: str, index: Any) -> Json:
        """Entry `index` of the root's array `kind`; refuses what is not there."""
        entries = self.json.get(kind, [])
        known = isinstance(index, int) and not isinstance(index, bool)
        if not known or not isinstance(entries, list) or not 0 <= index < len(entries):
            self.refuse(f"it refers to {kind} {index!r}, which it does not have")
        entry = entries[index]
        if not isinstance(entry, dict):
            self.refuse(f"its {kind} {index} is damaged")
        return dict(entry)

    def buffer(self, index: int) -> Bytes:
        """Bytes of a buffer, mapped from its file where it has one."""
        if index not in self._buffers:
            entry = self.item("buffers", index)
            data = self._load(index, entry)
            length = size_of(self, entry, "byteLength")
            if length > len(data):
                self.refuse(f"buffer {index} claims {length} bytes and has {len(data)}")
            self._buffers[index] = data[:length]
        return self._buffers[index]

    def slice(self, view: Json) -> Bytes:
        """Bytes that a buffer view, or an extension shaped like one, covers."""
        data = self.buffer(view.get("buffer", -1))
        start, length = size_of(self, view, "byteOffset", 0), size_of(self, view, "byteLength")
        if start + length > len(data):
            self.refuse("a buffer view reaches beyond its buffer")
        return data[start : start + length]

    def _load(self, index: int, entry: Json) -> Bytes:
        uri = entry.get("uri")
        if uri is None:
            if index != 0 or self._bin is None:
                self.refuse(f"buffer {index} has no data")
            return self._bin
        if not isinstance(uri, str):
            self.refuse(f"buffer {index} is damaged")
        if uri.startswith("data:"):
            return np.frombuffer(data_uri(self, uri), np.uint8)
        path = self.folder.find(uri, is_uri=True)
        if path is None:
            self.refuse(f"its file {uri[:80]!r} is missing")
        return map_file(path)

    def _split(self, whole: Bytes) -> Bytes:
        if len(whole) < 20:
            self.refuse("the file is too short")
        magic, version, length = struct.unpack("<III", whole[:12].tobytes())
        if magic != _MAGIC:
            self.refuse("it is not a GLB")
        if version != 2:
            self.refuse(f"it is a GLB of version {version}, not 2")
        if length > len(whole):
            self.refuse(f"the file is cut off: {len(whole)} of {length} bytes are there")
        text: Bytes | None = None
        start = 12
        while start + 8 <= length:
            size, kind = struct.unpack("<II", whole[start : start + 8].tobytes())
            chunk = whole[start + 8 : start + 8 + size]
            if len(chunk) < size:
                self.refuse("a chunk reaches beyond the file's end")
            if kind == _JSON and text is None:
                text = chunk
            elif kind == _BIN and self._bin is None:
                self._bin = chunk
            start += 8 + size
        if text is None:
            self.refuse("it has no JSON chunk")
        return text


def map_file(path: Path) -> Bytes:
    """Bytes of a file without reading them yet."""
    if path.stat().st_size == 0:
        return np.zeros(0, np.uint8)
    with path.open("rb") as file:
        return np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint8)


def data_uri(document: Document, uri: str) -> bytes:
    """Content of a base64 `data:` URI."""
    head, comma, body = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        document.refuse("it holds a data URI that is not base64")
    try:
        return base64.b64decode(body, validate=True)
    except binascii.Error:
        document.refuse("it holds a damaged data URI")


def size_of(document: Document, entry: Json, key: str, default: int | None = None) -> int:
    """Return a member that must be a whole number from 0 up; refuses anything else."""
    value = entry.get(key, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        document.refuse(f"a {key} is {value!r}")
    return value
