"""Exported walks, from a plain static host: the same pictures as from the server."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from farfield.__main__ import main
from farfield.server import Server
from farfield_core import layout
from farfield_core.store import Store
from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer

POSE = (4.0, 2.0, 4.0, 0.6, -0.1)


@pytest.fixture(scope="module")
def store(room: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The painted room as a store has it."""
    folder = tmp_path_factory.mktemp("export") / "store"
    store = Store.open(folder)
    walk = json.loads((room / "walk.json").read_text())
    places = {"cells": "cells/", "atlases": "../../blobs/atlases/", "near": "../../blobs/near/"}
    store.put(layout.walk_key("room"), json.dumps(walk | {"places": places}).encode())
    for file in room.rglob("*.*"):
        kind = file.parent.name
        if kind == "cells":
            store.put(f"{layout.cells_prefix('room')}{file.name}", file)
        elif kind in ("atlases", "near"):
            store.put(f"blobs/{kind}/{file.name}", file)
    return folder


@pytest.fixture(scope="module")
def host(pages: Path, store: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A static host with the pages and both exports; it answers ranges and knows no API."""
    folder = tmp_path_factory.mktemp("host")
    for out in ("walk", "walk.zip"):
        assert main(["export", "--store", str(store), "--out", str(folder / out), "--json"]) == 0
    app = FastAPI(openapi_url=None)
    app.mount("/exports", StaticFiles(directory=folder))
    app.mount("/", StaticFiles(directory=pages, html=True))
    server = Server("127.0.0.1", 0)
    with server.beside(app):
        yield server.address


@pytest.mark.parametrize("export", ["walk/walk.json", "walk.zip"])
def test_an_export_shows_what_the_server_shows(
    visit: Visit, server: WalkServer, host: str, export: str
) -> None:
    visit.open(f"{server.url}/walk/room?capture")
    visit.go_to(*POSE)
    wanted = visit.pixels()
    visit.open(f"{host}/walk/index.html?walk=../exports/{export}&capture")
    visit.go_to(*POSE)
    assert np.array_equal(visit.pixels(), wanted)


def test_files_of_an_export(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["export", "room", "--store", str(store), "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {"walk.json", "walk.json.br", "walk.json.gz",
                                                     "cells", "atlases", "near"}  # fmt: skip
    assert main(["export", "room", "--store", str(store), "--out", str(out)]) == 2
    assert "not empty" in capsys.readouterr().err
    assert main(["export", "none", "--store", str(store), "--out", str(tmp_path / "x")]) == 4
    packed = [tmp_path / "one.zip", tmp_path / "two.zip"]
    for target in packed:
        assert main(["export", "--store", str(store), "--out", str(target)]) == 0
    assert packed[0].read_bytes() == packed[1].read_bytes()
