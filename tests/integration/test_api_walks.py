"""What a viewer reads over HTTP: manifests, cells, blobs, and how long they may be kept."""

import gzip
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from farfield_core import layout
from farfield_core.bake import read_walk
from farfield_core.store import Store
from farfield_core.tables import PAGE_CELLS
from farfield_core.walk import Walk
from fastapi.testclient import TestClient

from tests.integration.serving import client_over, problem
from tests.unit.walks import row_of_cells

FOREVER = "public, max-age=31536000, immutable"
ATLAS = "0123456789abcdef" * 2 + ".png"
NEAR = "fedcba9876543210" * 2 + ".glb"
CELL = json.dumps({"cell": [0, 0, 0], "numbers": list(range(1000))}).encode()


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "store")


@pytest.fixture
def walk(store: Store) -> Walk:
    walk = row_of_cells(store, 3)
    store.put_new(layout.cell_key(walk.id, (0, 0, 0)), CELL)
    store.put_new(layout.atlas_key(ATLAS), b"\x89PNG" + bytes(range(256)))
    store.put_new(layout.near_key(NEAR), b"glTF" + bytes(range(256)))
    return walk


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with client_over(tmp_path / "store") as client:
        yield client


def test_the_manifest_is_relative_to_its_address(client: TestClient, walk: Walk) -> None:
    answer = client.get(f"walks/{walk.id}/walk.json")
    assert answer.headers["cache-control"] == FOREVER
    sent = answer.json()
    assert sent.pop("places") == {"cells": "cells/", "atlases": "atlases/", "near": "near/"}
    kept = walk.model_dump(mode="json")
    del kept["places"]
    assert sent == json.loads(json.dumps(kept))


def test_a_large_corridor_comes_in_pages(client: TestClient, store: Store) -> None:
    walk = row_of_cells(store, PAGE_CELLS + 10)
    pages = client.get(f"walks/{walk.id}/walk.json").json()["grid"]["pages"]
    tables = [client.get(f"walks/{walk.id}/{page['href']}") for page in pages]
    assert [len(table.json()["i"]) for table in tables] == [page["cells"] for page in pages]
    assert sorted(i for table in tables for i in table.json()["i"]) == list(range(PAGE_CELLS + 10))
    assert tables[0].headers["cache-control"] == FOREVER
    problem(client.get(f"walks/{walk.id}/pages/99.json"), 404)


def test_the_list_of_cells_comes_in_pages(client: TestClient, store: Store) -> None:
    walk = row_of_cells(store, 2500)
    for i in range(2500):
        store.put_new(layout.cell_key(walk.id, (i, 0, 0)), b"{}")
    found, page, pages = [], "0", 0
    while page is not None:
        body = client.get(f"walks/{walk.id}/cells", params={"page": page}).json()
        found += body["cells"]
        page, pages = body["next"], pages + 1
    assert pages == 3
    assert len(found) == len(set(found)) == 2500


def test_a_cell(client: TestClient, walk: Walk) -> None:
    answer = client.get(f"walks/{walk.id}/cells/0_0_0.json")
    assert answer.content == CELL
    assert answer.headers["content-type"] == "application/json"
    assert answer.headers["content-encoding"] == "br"
    assert answer.headers["cache-control"] == FOREVER
    assert "accept-encoding" in answer.headers["vary"].lower()


def test_a_cell_is_sent_plain_to_those_who_want_it_so(client: TestClient, walk: Walk) -> None:
    address = f"walks/{walk.id}/cells/0_0_0.json"
    plain = client.get(address, headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    assert int(plain.headers["content-length"]) == len(CELL)
    with client.stream("GET", address, headers={"Accept-Encoding": "gzip"}) as packed:
        assert gzip.decompress(b"".join(packed.iter_raw())) == CELL


@pytest.mark.parametrize("path", ["walk.json", "cells/0_0_0.json", f"atlases/{ATLAS}"])
def test_a_known_version_is_not_sent_again(client: TestClient, walk: Walk, path: str) -> None:
    address = f"walks/{walk.id}/{path}"
    etag = client.get(address).headers["etag"]
    for known in (etag, f'"other", {etag}', "*", etag.removeprefix("W/")):
        again = client.get(address, headers={"If-None-Match": known})
        assert (again.status_code, again.content) == (304, b"")
        assert (again.headers["etag"], again.headers["cache-control"]) == (etag, FOREVER)
    assert client.get(address, headers={"If-None-Match": '"other"'}).status_code == 200


def test_an_unbaked_cell_may_not_be_remembered(client: TestClient, walk: Walk) -> None:
    for headers in ({}, {"If-None-Match": "*"}):
        answer = client.get(f"walks/{walk.id}/cells/1_0_0.json", headers=headers)
        assert "1_0_0" in problem(answer, 404)


def test_blobs(client: TestClient, walk: Walk) -> None:
    atlas = client.get(f"walks/{walk.id}/atlases/{ATLAS}")
    assert (atlas.status_code, atlas.headers["content-type"]) == (200, "image/png")
    assert atlas.headers["etag"] == f'"{ATLAS.removesuffix(".png")}"'
    assert atlas.headers["cache-control"] == FOREVER
    assert "content-encoding" not in atlas.headers
    near = client.get(f"walks/{walk.id}/near/{NEAR}")
    assert (near.status_code, near.headers["content-type"]) == (200, "model/gltf-binary")
    assert near.content[:4] == b"glTF"
    problem(client.get(f"walks/{walk.id}/near/{ATLAS}"), 404)


def test_near_blocks_are_packed_once(client: TestClient, walk: Walk) -> None:
    address = f"walks/{walk.id}/near/{NEAR}"
    plain = client.get(address, headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    tags = {plain.headers["etag"]}
    for accepted, coding in {"gzip, br": "br", "gzip": "gzip"}.items():
        sent = client.get(address, headers={"Accept-Encoding": accepted})
        assert (sent.headers["content-encoding"], sent.content) == (coding, plain.content)
        assert sent.headers["content-type"] == "model/gltf-binary"
        assert (sent.headers["vary"], sent.headers["cache-control"]) == ("Accept-Encoding", FOREVER)
        known = {"Accept-Encoding": accepted, "If-None-Match": sent.headers["etag"]}
        assert client.get(address, headers=known).status_code == 304
        tags.add(sent.headers["etag"])
    assert len(tags) == 3
    lost = address.replace(NEAR, "0" * 32 + ".glb")
    problem(client.get(lost, headers={"Accept-Encoding": "br"}), 404)


def test_blobs_come_in_ranges(client: TestClient, walk: Walk) -> None:
    address = f"walks/{walk.id}/near/{NEAR}"
    part = client.get(address, headers={"Range": "bytes=4-7"})
    assert (part.status_code, part.content) == (206, bytes(range(4)))
    assert part.headers["content-range"] == "bytes 4-7/260"
    assert "content-encoding" not in part.headers
    assert client.get(address, headers={"Range": "bytes=300-"}).status_code == 416


@pytest.mark.parametrize("path", ["walk.json", "cells/0_0_0.json", f"near/{NEAR}"])
def test_head_is_get_without_a_body(client: TestClient, walk: Walk, path: str) -> None:
    address = f"walks/{walk.id}/{path}"
    head, get = client.head(address), client.get(address)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["etag"] == get.headers["etag"]


@pytest.mark.parametrize(
    "path",
    [
        "cells/../walk.json",
        "cells/0_0.json",
        "cells/..%2f..%2fwalk.json",
        "atlases/..%2f..%2f..%2fbakes",
        "atlases/../../../etc/passwd",
        f"atlases/{ATLAS}%00.png",
        "near/" + "0" * 32 + ".glb/../../x",
        "pages/..%2fwalk.json",
        "pages/-1.json",
    ],
)
def test_nothing_outside_a_walk_is_served(client: TestClient, walk: Walk, path: str) -> None:
    answer = client.get(f"walks/{walk.id}/{path}")
    # Clients resolve plain dots themselves, which may lead back to the manifest.
    if answer.url.path.endswith(f"{walk.id}/walk.json"):
        assert Walk.model_validate(answer.json()).id == walk.id
    else:
        assert answer.status_code in (404, 422)


def test_a_store_that_is_no_folder_serves_the_same(walk: Walk, store: Store) -> None:
    from farfield_api import immutable
    from fastapi import Request

    memory = Store.open("memory://")
    memory.put_new(layout.near_key(NEAR), store.get(layout.near_key(NEAR)))
    request = Request({"type": "http", "headers": []})
    answer = immutable.blob(request, memory, layout.near_key(NEAR))
    assert answer.body == store.get(layout.near_key(NEAR))
    assert answer.headers["cache-control"] == FOREVER
    assert read_walk(store, walk.id) == walk
