"""Walks behind the web server that Compose and the chart put before the API."""

from __future__ import annotations

import json
from collections.abc import Iterator

import httpx2
import pytest
from farfield_core import layout
from farfield_core.store import Store

from tests.integration.live import Live, serving
from tests.integration.test_api_uploads import BYTES, TUS, named
from tests.integration.web import NGINX, web_server
from tests.unit.walks import row_of_cells

pytestmark = pytest.mark.skipif(NGINX is None, reason="nginx is not installed")

NEAR = "fedcba9876543210" * 2 + ".glb"
BLOCK = b"glTF" + bytes(range(256))
CELL = json.dumps({"cell": [0, 0, 0], "numbers": list(range(1000))}).encode()

#: what clients accept -> what they are sent
FORMS = {
    "br": "br",
    "gzip, deflate, br, zstd": "br",
    "gzip": "gzip",
    "gzip;q=0.5, deflate": "gzip",
}


class Behind:
    """A walk of three cells, the first of them baked, behind the web server."""

    def __init__(self, live: Live, web: str, store: Store) -> None:
        self.live, self.web, self.store = live, web, store
        self.walk = row_of_cells(store, 3).id
        store.put_new(layout.cell_key(self.walk, (0, 0, 0)), CELL)
        store.put_new(layout.near_key(NEAR), BLOCK)

    def get(self, path: str, coding: str = "identity", **headers: str) -> httpx2.Response:
        asked = {"Accept-Encoding": coding} | {k.replace("_", "-"): v for k, v in headers.items()}
        return httpx2.get(f"{self.web}/api/v1/walks/{self.walk}/{path}", headers=asked)

    def asked(self, route: str) -> float:
        """How many requests of a route the API has answered."""
        lines = httpx2.get(f"{self.live.url}/metrics").text.splitlines()
        counts = [x for x in lines if x.startswith("farfield_requests_total") and route in x]
        return sum(float(line.rsplit(" ", 1)[1]) for line in counts)


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Behind]:
    folder = tmp_path_factory.mktemp("web")
    with (
        serving(folder / "store") as live,
        web_server(live.url, folder / "nginx") as web,
    ):
        yield Behind(live, web, Store.open(folder / "store"))


def test_the_api_sends_a_cell_once_in_each_form(behind: Behind) -> None:
    before = behind.asked("cells/{cell}.json")
    for _ in range(5):
        plain = behind.get("cells/0_0_0.json")
        assert plain.content == CELL
        assert "immutable" in plain.headers["cache-control"]
        for coding, form in FORMS.items():
            sent = behind.get("cells/0_0_0.json", coding)
            assert sent.headers["content-encoding"] == form
            assert sent.json() == json.loads(CELL)
    assert behind.asked("cells/{cell}.json") == before + 3


def test_known_versions_and_ranges_come_from_the_web_server(behind: Behind) -> None:
    near = behind.get(f"near/{NEAR}")
    assert (near.content, near.headers["content-type"]) == (BLOCK, "model/gltf-binary")
    before = behind.asked("near/{name}")
    again = behind.get(f"near/{NEAR}", If_None_Match=near.headers["etag"])
    assert (again.status_code, again.content) == (304, b"")
    part = behind.get(f"near/{NEAR}", Range="bytes=4-7")
    assert (part.status_code, part.content) == (206, bytes(range(4)))
    assert behind.asked("near/{name}") == before


def test_a_cell_that_is_not_baked_is_asked_for_every_time(behind: Behind) -> None:
    assert behind.get("cells/1_0_0.json").status_code == 404
    behind.store.put_new(layout.cell_key(behind.walk, (1, 0, 0)), CELL)
    assert behind.get("cells/1_0_0.json").content == CELL


def test_everything_else_reaches_the_api(behind: Behind) -> None:
    assert httpx2.get(f"{behind.web}/api/v1/bakes").json()["bakes"][0]["id"] == behind.walk
    assert behind.get("cells").json()["cells"][0] == "0_0_0"
    missing = behind.get("near/..%2f..%2fx")
    assert missing.status_code in (404, 422)
    data = b"solid " * 1_000_000
    headers = TUS | {"Upload-Length": str(len(data)), "Upload-Metadata": named("some.stl")}
    made = httpx2.post(f"{behind.web}/api/v1/uploads", headers=headers)
    assert made.status_code == 201, made.text
    sent = httpx2.patch(
        behind.web + made.headers["location"],
        headers=TUS | BYTES | {"Upload-Offset": "0"},
        content=data,
    )
    assert (sent.status_code, sent.headers["upload-offset"]) == (204, str(len(data)))
