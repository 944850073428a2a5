"""JSON and near blocks of walks, compressed once: their forms lie beside what they are made from.

    bakes/<bake>/cells/<i>_<j>_<k>.json      the cell, which alone says that it is done
    bakes/<bake>/cells/<i>_<j>_<k>.json.br   brotli, made when first asked for, or by an export
    blobs/near/<hash>.glb.gz                 gzip, likewise

A web server in front of a store in a folder can send them itself. Cells are 1 to 3 MB of JSON, so
compressing them at every request would cost more than all else; what was sent lately is kept.
"""

from __future__ import annotations

import contextlib
import gzip
import os
import re
import threading
from collections import OrderedDict
from typing import Literal, NamedTuple

import brotli
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.store import Store

Coding = Literal["br", "gzip", "identity"]

SUFFIXES: dict[Coding, str] = {"br": ".br", "gzip": ".gz", "identity": ""}

#: levels
_BROTLI, _GZIP = 5, 6
#: bytes kept in memory
_KEPT = 48 << 20
_TOKEN = re.compile(r"^\s*([\w*-]+)\s*(?:;\s*q=([\d.]+)\s*)?$")


class Packed(NamedTuple):
    """An object as it is sent."""

    data: bytes
    coding: Coding


def choose(accepted: str) -> Coding:
    """The best form that an Accept-Encoding allows (RFC 9110, 12.5.3)."""
    quality: dict[str, float] = {}
    for part in accepted.lower().split(","):
        if match := _TOKEN.match(part):
            try:
                quality[match[1]] = float(match[2] or 1)
            except ValueError:
                continue
    other = quality.get("*", 0.0)
    for coding in ("br", "gzip"):
        if quality.get(coding, other) > 0:
            return "br" if coding == "br" else "gzip"
    return "identity"


def pack(data: bytes, coding: Coding) -> bytes:
    """Compress; the same bytes always give the same bytes."""
    if coding == "br":
        mode = brotli.MODE_GENERIC if data[:4] == b"glTF" else brotli.MODE_TEXT
        packed: bytes = brotli.compress(data, mode=mode, quality=_BROTLI)
        return packed
    return gzip.compress(data, _GZIP, mtime=0) if coding == "gzip" else data


class PackedObjects:
    """Objects of a store in any form; those sent lately are kept in memory."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._recent: OrderedDict[tuple[str, Coding], bytes] = OrderedDict()
        self._size = 0
        # each takes several times the memory of what it compresses
        self._packing = threading.BoundedSemaphore(os.cpu_count() or 1)
        self._making: dict[str, threading.Lock] = {}

    def recent(self, key: str, coding: Coding) -> bytes | None:
        """What is at hand, without a look into the store."""
        with self._lock:
            data = self._recent.get((key, coding))
            if data is not None:
                self._recent.move_to_end((key, coding))
            return data

    def get(self, key: str, coding: Coding) -> bytes:
        """An object in a form; raises NotFoundError."""
        data = self.recent(key, coding)
        if data is None:
            data = self._find(key, coding)
            self._keep((key, coding), data)
        return data

    def _find(self, key: str, coding: Coding) -> bytes:
        if coding == "identity":
            return self._store.get(key)
        name = key + SUFFIXES[coding]
        try:
            return self._store.get(name)
        except NotFoundError:
            pass
        with self._lock:
            making = self._making.setdefault(name, threading.Lock())
        try:
            with making:  # many who ask at once wait for one
                data = self.recent(key, coding)
                if data is None:
                    with self._packing:
                        data = pack(self._store.get(key), coding)
                    self._keep((key, coding), data)
                    # a store that is only read is served all the same
                    with contextlib.suppress(FarfieldError):
                        self._store.put_new(name, data)
                return data
        finally:
            with self._lock:
                self._making.pop(name, None)

    def _keep(self, at: tuple[str, Coding], data: bytes) -> None:
        with self._lock:
            if at not in self._recent and len(data) <= _KEPT // 4:
                self._recent[at] = data
                self._size += len(data)
            while self._size > _KEPT:
                _, gone = self._recent.popitem(last=False)
                self._size -= len(gone)
