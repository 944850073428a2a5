"""A real server on a real socket: events as they happen, bodies without a length, slow clients."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
import uvicorn
from farfield_api.routers import events
from farfield_api.server import Server

from tests.integration.serving import API, app_over, row, until


@contextmanager
def served(folder: Path, **how: Any) -> Iterator[httpx2.Client]:
    """A server on a free port of this machine, and a client of it."""
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    config = uvicorn.Config(app_over(folder, **how), log_level="warning", ws="none")
    server = Server(config)
    thread = threading.Thread(
        target=lambda: asyncio.run(server.serve(sockets=[listener])), name="server"
    )
    thread.start()
    try:
        until(lambda: server.started)
        address = f"http://127.0.0.1:{port}{API}/"
        with httpx2.Client(base_url=address, timeout=30, trust_env=False) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


def bake(client: httpx2.Client, cells: int = 4) -> str:
    scene = client.post("scenes", files={"file": ("town.glb", b"a model")}).json()["id"]
    until(lambda: client.get(f"scenes/{scene}").json()["state"] == "ready")
    settings = {"resolution": 64, "layers": 4}
    body = {"scene": scene, "corridor": row(cells), "settings": settings}
    return str(client.post("bakes", json=body).json()["id"])


Events = list[tuple[str, Any, str | None]]


def listen(client: httpx2.Client, address: str, last: str | None = None) -> Iterator[Events]:
    """Yield all events so far, each (event, data, id), after every one of them."""
    headers = {} if last is None else {"Last-Event-ID": last}
    heard: Events = []
    with client.stream("GET", address, headers=headers) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        assert answer.headers["cache-control"] == "no-cache"
        assert "content-encoding" not in answer.headers
        fields: dict[str, str] = {}
        for line in answer.iter_lines():
            if line:
                name, _, value = line.partition(": ")
                fields[name] = value
            elif fields:
                heard.append((fields["event"], json.loads(fields["data"]), fields.get("id")))
                fields = {}
                yield heard


def test_events_tell_of_every_cell_as_it_comes(tmp_path: Path) -> None:
    with served(tmp_path, **{"c*": 0.4}) as client:
        name = bake(client)
        told: list[str] = []
        for heard in listen(client, f"bakes/{name}/events"):
            kind, data, _ = heard[-1]
            if kind == "cells":
                told += data
                assert all(
                    client.get(f"walks/{name}/cells/{cell}.json").status_code == 200
                    for cell in data
                )
        assert sorted(told) == [f"{i}_0_0" for i in range(4)]
        states = [data for kind, data, _ in heard if kind == "state"]
        assert states[0]["state"] in ("queued", "running")
        assert states[-1]["state"] == "done"
        assert states[-1]["cells"] == {"total": 4, "done": 4, "failed": 0}
        assert len(states) >= 3
        assert heard[-1][:2] == ("end", "done")


def test_a_client_that_comes_back_hears_what_it_missed(tmp_path: Path) -> None:
    with served(tmp_path, **{"c*": 0.3}) as client:
        name = bake(client)
        known: list[str] = []
        for heard in listen(client, f"bakes/{name}/events"):
            kind, data, last = heard[-1]
            if kind == "cells":
                known = data
                break
        until(lambda: client.get(f"bakes/{name}").json()["state"] == "done")
        *_, heard = listen(client, f"bakes/{name}/events", last)
        missed = [cell for kind, cells, _ in heard if kind == "cells" for cell in cells]
        assert sorted(known + missed) == [f"{i}_0_0" for i in range(4)]
        *_, heard = listen(client, f"bakes/{name}/events", "another:3")
        everything = [cell for kind, cells, _ in heard if kind == "cells" for cell in cells]
        assert len(everything) == 4


def test_a_quiet_stream_is_kept_alive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fastapi.routing._PING_INTERVAL", 0.2)
    monkeypatch.setattr(events, "INTERVAL", 0.1)
    with served(tmp_path, **{"c*": 3}) as client:
        name = bake(client, cells=1)
        with client.stream("GET", f"bakes/{name}/events") as answer:
            lines = []
            for line in answer.iter_lines():
                lines.append(line)
                if line.startswith(":"):
                    break
        assert lines[-1] == ": ping"


def test_the_server_stops_while_somebody_listens(tmp_path: Path) -> None:
    started = threading.Event()
    with served(tmp_path, **{"c*": 0.5}) as client:
        name = bake(client, cells=100)
        address = str(client.base_url.join(f"bakes/{name}/events"))

        def hang() -> None:
            with (
                httpx2.Client(timeout=30, trust_env=False) as other,
                other.stream("GET", address) as a,
            ):
                for _ in a.iter_lines():
                    started.set()

        listener = threading.Thread(target=hang)
        listener.start()
        assert started.wait(30)
        stopping = time.monotonic()
    listener.join(timeout=30)
    assert not listener.is_alive()
    assert time.monotonic() - stopping < 15


def test_an_upload_without_a_length_is_limited_as_well(tmp_path: Path) -> None:
    boundary = "b0undary"
    head = (
        f'--{boundary}\r\nContent-Disposition: form-data; name="file"; filename="big.glb"\r\n\r\n'
    ).encode()

    def body(chunks: int) -> Iterator[bytes]:
        yield head
        for _ in range(chunks):
            yield b"x" * 10_000
        yield f"\r\n--{boundary}--\r\n".encode()

    headers = {"Content-Type": f"multipart/form-data; boundary={boundary}"}
    with served(tmp_path) as client:
        fits = client.post("scenes", content=body(9), headers=headers)
        assert fits.status_code == 201
        over = client.post("scenes", content=body(11), headers=headers)
        assert over.status_code == 413
        assert over.headers["content-type"] == "application/problem+json"
        assert client.get("health").status_code == 200
