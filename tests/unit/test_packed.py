"""Compressed forms of JSON: which one a client gets, and that it is made once."""

from __future__ import annotations

import gzip
from pathlib import Path

import brotli
import pytest
from farfield_api.packed import PackedObjects, choose, pack
from farfield_core.errors import NotFoundError
from farfield_core.store import Store
from hypothesis import given
from hypothesis import strategies as st


@pytest.mark.parametrize(
    ("accepted", "coding"),
    [
        ("", "identity"),
        ("br", "br"),
        ("gzip", "gzip"),
        ("gzip, deflate, br, zstd", "br"),
        ("gzip;q=1.0, br;q=0", "gzip"),
        ("br;q=0, gzip;q=0", "identity"),
        ("*", "br"),
        ("*;q=0", "identity"),
        ("br;q=0, *;q=0.5", "gzip"),
        ("identity", "identity"),
        ("deflate", "identity"),
        ("BR", "br"),
        ("br;q=nonsense", "identity"),
        ("gzip;q=1.2.3", "identity"),
    ],
)
def test_choice(accepted: str, coding: str) -> None:
    assert choose(accepted) == coding


@given(st.text(max_size=60))
def test_any_header_gets_an_answer(accepted: str) -> None:
    assert choose(accepted) in ("br", "gzip", "identity")


@given(st.binary(max_size=2000))
def test_forms_hold_the_same(data: bytes) -> None:
    assert brotli.decompress(pack(data, "br")) == data
    assert gzip.decompress(pack(data, "gzip")) == data
    assert pack(data, "gzip") == pack(data, "gzip")


def test_forms_are_made_once_and_kept(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    store.put("bakes/b/cells/0_0_0.json", b'{"a": 1}')
    packed = PackedObjects(store)
    assert packed.recent("bakes/b/cells/0_0_0.json", "br") is None
    data = packed.get("bakes/b/cells/0_0_0.json", "br")
    assert brotli.decompress(data) == b'{"a": 1}'
    assert store.get("bakes/b/cells/0_0_0.json.br") == data
    assert packed.recent("bakes/b/cells/0_0_0.json", "br") == data
    # another server finds what is there
    assert PackedObjects(store).get("bakes/b/cells/0_0_0.json", "br") == data
    with pytest.raises(NotFoundError):
        packed.get("bakes/b/cells/1_0_0.json", "br")
    assert not store.exists("bakes/b/cells/1_0_0.json.br")


def test_memory_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("farfield_api.packed._KEPT", 1000)
    store = Store.open(tmp_path)
    packed = PackedObjects(store)
    for n in range(10):
        store.put(f"{n}.json", bytes(200))
        packed.get(f"{n}.json", "identity")
    kept = [packed.recent(f"{n}.json", "identity") is not None for n in range(10)]
    assert kept == [False] * 5 + [True] * 5
