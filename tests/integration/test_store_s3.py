"""The store on real S3 servers: the contract, signed reads, and servers that fail."""

import secrets
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from farfield_core import scenes
from farfield_core.scene_cache import cached_scene, release_scenes
from farfield_core.store import Store, StoreError

from tests.integration.servers import (
    BUCKET,
    Faults,
    MotoServer,
    S3Server,
    running,
    s3_environment,
    versitygw,
)
from tests.store_contract import *  # noqa: F403 - the contract's tests run here, on these stores

# where Go is not installed, `make setup` builds no versitygw
SERVERS = ["moto", "versitygw"] if versitygw() else ["moto"]


@pytest.fixture(scope="module", params=SERVERS)
def server(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[S3Server | MotoServer]:
    if request.param == "moto":
        server: S3Server | MotoServer = MotoServer()
    else:
        server = S3Server(tmp_path_factory.mktemp("s3"))
    with running(server):
        yield server


def open_store(monkeypatch: pytest.MonkeyPatch, endpoint: str, patience: float = 10.0) -> Store:
    """A store of its own on a server, opened as a user would: by environment variables."""
    for name, value in s3_environment(endpoint).items():
        monkeypatch.setenv(name, value)
    return Store.open(f"s3://{BUCKET}/{secrets.token_hex(4)}", patience=patience)


@pytest.fixture
def store(server: S3Server | MotoServer, monkeypatch: pytest.MonkeyPatch) -> Store:
    return open_store(monkeypatch, server.endpoint)


@pytest.fixture
def faults(server: S3Server | MotoServer) -> Iterator[Faults]:
    proxy = Faults(server.port)
    yield proxy
    proxy.close()


def test_signed_addresses_can_be_read_for_a_while(
    store: Store, server: S3Server | MotoServer
) -> None:
    store.put("a/b.json", b"0123456789")
    address = store.signed("a/b.json", 60)
    assert address is not None
    request = urllib.request.Request(address, headers={"Range": "bytes=2-4"})
    with urllib.request.urlopen(request) as answer:
        assert (answer.status, answer.read()) == (206, b"234")
    if isinstance(server, MotoServer):  # checks no signatures
        return
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(address.replace("b.json", "c.json"))
    refused.value.close()
    assert refused.value.code == 403
    gone = store.signed("a/b.json", 1)
    assert gone is not None
    time.sleep(2.1)
    with pytest.raises(urllib.error.HTTPError) as late:
        urllib.request.urlopen(gone)
    late.value.close()
    assert late.value.code == 403


def test_files_are_fetched_piece_by_piece(store: Store, tmp_path: Path) -> None:
    data = secrets.token_bytes(20_000_000)
    store.put("big", data)
    store.fetch("big", tmp_path / "copy")
    assert (tmp_path / "copy").read_bytes() == data


def test_faults_are_got_over(faults: Faults, monkeypatch: pytest.MonkeyPatch) -> None:
    store = open_store(monkeypatch, faults.endpoint, patience=60)
    faults.share = 0.1
    threads = [
        threading.Thread(target=lambda n=n: [store.put_new(f"x/{n}/{i}", b"y") for i in range(3)])
        for n in range(20)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert faults.faults > 0
    assert set(store.list("x/")) == {f"x/{n}/{i}" for n in range(20) for i in range(3)}
    assert all(store.get(f"x/{n}/0") == b"y" for n in range(4))


def test_a_server_that_is_gone_is_sat_out(faults: Faults, monkeypatch: pytest.MonkeyPatch) -> None:
    store = open_store(monkeypatch, faults.endpoint, patience=60)
    faults.gone = True
    timer = threading.Timer(3.0, lambda: setattr(faults, "gone", False))
    timer.start()
    began = time.monotonic()
    assert store.put_new("a", b"x") is True
    assert time.monotonic() - began > 2
    timer.join()


def test_patience_ends(faults: Faults, monkeypatch: pytest.MonkeyPatch) -> None:
    store = open_store(monkeypatch, faults.endpoint, patience=1.0)
    faults.gone = True
    for call in (lambda: store.put("a", b"x"), lambda: store.get("a"), lambda: store.exists("a")):
        with pytest.raises(StoreError, match=r"^The store failed on a: [^\n]*\.$"):
            call()


def test_a_machine_fetches_a_scene_once(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FARFIELD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("FARFIELD_CACHE_BYTES", "2500")
    for n in range(4):
        for name, data in (("positions.npy", b"p" * 990), ("scene.json", b"s" * 10)):
            store.put(f"scenes/{n}/prepared/{name}", data)
    first = cached_scene(store, "0")
    assert first == cached_scene(store, "0") == scenes.prepared_folder(store, "0")
    assert (first / "positions.npy").read_bytes() == b"p" * 990
    store.delete("scenes/0/prepared/positions.npy")
    assert cached_scene(store, "0") == first  # from this machine
    second = cached_scene(store, "1")
    third = cached_scene(store, "2")
    assert [path.exists() for path in (first, second, third)] == [True] * 3  # all are in use
    release_scenes()
    fourth = cached_scene(store, "3")
    assert fourth.exists()
    assert third.exists()
    assert not first.exists()
    assert not second.exists()
    release_scenes()
