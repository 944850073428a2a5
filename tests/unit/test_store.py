"""Stores in folders and in memory: the contract, and what only folders have."""

from pathlib import Path

import pytest
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store, StoreError

from tests.store_contract import *  # noqa: F403 - the contract's tests run here, on these stores


@pytest.fixture(params=["folder", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    return Store.open("memory://" if request.param == "memory" else tmp_path / "a store")


def test_unfinished_copies_are_not_listed(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    store.put("a/b", b"")
    (tmp_path / "a" / "c#123456").write_bytes(b"half")
    assert list(store.list("a/")) == ["a/b"]


def test_folders(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError):
        Store.open(tmp_path / "s", create=False)
    store = Store.open(tmp_path / "s")
    store.put("a/b", b"x")
    path = store.local_path("a/b")
    assert path == tmp_path / "s" / "a" / "b"
    assert path.read_bytes() == b"x"
    assert store.local_path("a/") == tmp_path / "s" / "a"
    assert Store.open(store.url, create=False).get("a/b") == b"x"
    assert Store.open(f"file://{tmp_path}/s").get("a/b") == b"x"
    store.delete_prefix("a/")
    assert not (tmp_path / "s" / "a").exists()
    store.remove_if_empty()
    assert not (tmp_path / "s").exists()


def test_memory_lies_nowhere() -> None:
    assert Store.open("memory://").local_path("a") is None


def test_addresses_that_are_no_store(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for place in ("", "http://example.org/x", tmp_path / "file"):
        with pytest.raises(BadInputError):
            Store.open(place)


def test_a_store_that_fails_says_so_in_one_sentence(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    store.put("a", b"")
    with pytest.raises(StoreError, match=r"^The store failed on a/b: [^\n]*\.$"):
        store.put("a/b", b"")  # a is a file
