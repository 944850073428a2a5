"""What every store promises, whatever lies below: run on folders, memory and S3 servers."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store


def test_put_new_creates_once(store: Store) -> None:
    assert store.put_new("bakes/b/cells/0_0_0.json", b"first") is True
    assert store.put_new("bakes/b/cells/0_0_0.json", b"second") is False
    assert store.get("bakes/b/cells/0_0_0.json") == b"first"


def test_of_many_who_create_one_wins(store: Store) -> None:
    wins: list[int] = []
    barrier = threading.Barrier(8)

    def create(n: int) -> None:
        barrier.wait()
        if store.put_new("x/y", str(n).encode()):
            wins.append(n)

    threads = [threading.Thread(target=create, args=(n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(wins) == 1
    assert store.get("x/y") == str(wins[0]).encode()


def test_put_replaces(store: Store) -> None:
    store.put("a/b", b"one")
    store.put("a/b", b"three")
    assert store.get("a/b") == b"three"
    assert store.size("a/b") == 5


def test_files_are_put_whole(store: Store, tmp_path: Path) -> None:
    file = tmp_path / "big.bin"
    file.write_bytes(os.urandom(3_000_000))
    assert store.put_new("one", file) is True
    assert store.put_new("one", file) is False
    store.put("two", file)
    store.put("two", file)
    assert store.get("one") == store.get("two") == file.read_bytes()
    assert set(store.list("")) == {"one", "two"}


def test_ranges(store: Store) -> None:
    store.put("a", b"0123456789")
    assert store.get_range("a", 2, 5) == b"234"
    assert store.get_range("a", 8, 99) == b"89"
    for start, end in [(10, 12), (-1, 2), (5, 5), (7, 3)]:
        with pytest.raises(BadInputError):
            store.get_range("a", start, end)
    with pytest.raises(NotFoundError):
        store.get_range("b", 0, 1)


def test_what_is_not_there(store: Store) -> None:
    for ask in (store.get, store.size):
        with pytest.raises(NotFoundError, match=r"^There is no a/b in the store\.$"):
            ask("a/b")
    assert not store.exists("a/b")
    store.put("a/b/c", b"")
    assert store.exists("a/b/c")
    assert store.get("a/b/c") == b""
    assert not store.exists("a/b")  # a folder is no object


def test_list(store: Store) -> None:
    keys = {f"x/{n}/{m}.json" for n in range(3) for m in range(700)} | {"xy/1", "x.json", "y/ü ö.t"}
    for key in keys:
        store.put_new(key, b"")
    assert set(store.list("x/")) == {key for key in keys if key.startswith("x/")}
    assert set(store.list("x/2/")) == {key for key in keys if key.startswith("x/2/")}
    assert set(store.list("")) == keys
    assert list(store.list("nothing/")) == []
    with pytest.raises(BadInputError):
        list(store.list("x"))


def test_delete(store: Store) -> None:
    store.put("a/b/c", b"")
    store.put("a/d", b"")
    store.delete("a/d")
    store.delete("a/d")
    assert list(store.list("a/")) == ["a/b/c"]
    assert store.delete_prefix("a/") == 1
    assert store.delete_prefix("a/") == 0
    assert list(store.list("")) == []


@pytest.mark.parametrize(
    "key", ["", "/a", "a/", "a//b", "../a", "a/../b", "a/.", "a\\b", "a\0b", "a\nb", "a#1"]
)
def test_bad_keys_are_refused(store: Store, key: str) -> None:
    calls: list[Callable[[], object]] = [
        lambda: store.get(key),
        lambda: store.put(key, b""),
        lambda: store.put_new(key, b""),
        lambda: store.exists(key),
        lambda: store.delete(key),
    ]
    for call in calls:
        with pytest.raises(BadInputError):
            call()
    assert list(store.list("")) == []
