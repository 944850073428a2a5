"""What a server tells of itself: lists in pages, readiness, logs, numbers, traces."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import pytest
from farfield_api.observe import JsonLines, Tracing
from fastapi.testclient import TestClient
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from tests.integration.serving import (
    API,
    app_over,
    client_over,
    ready_scene,
    row,
    start_bake,
    until,
    upload,
)


def walked(client: TestClient, path: str, kind: str, limit: int, **query: str) -> list[str]:
    """Ids of a list, page by page."""
    found: list[str] = []
    cursor: str | None = ""
    while cursor is not None:
        asked = {"limit": str(limit), **query} | ({"cursor": cursor} if cursor else {})
        body = client.get(path, params=asked).json()
        assert len(body[kind]) <= limit
        found += [entry["id"] for entry in body[kind]]
        cursor = body["next"]
    return found


def test_lists_come_in_pages(tmp_path: Path) -> None:
    with client_over(tmp_path / "store") as client:
        scenes = sorted(upload(client, f"model {n}".encode()) for n in range(5))
        for limit in (1, 2, 5, 100):
            assert walked(client, "scenes", "scenes", limit) == scenes
        scene = ready_scene(client)
        bakes = []
        for cells in (1, 2, 3):
            body = {"scene": scene, "corridor": row(cells), "settings": {"resolution": 64}}
            bakes.append(client.post("bakes", json=body).json()["id"])
        for limit in (1, 2, 3):
            assert walked(client, "bakes", "bakes", limit) == bakes
            assert walked(client, "bakes", "bakes", limit, order="newest") == bakes[::-1]
        assert walked(client, "bakes", "bakes", 2, scene=scene) == bakes
        assert walked(client, "bakes", "bakes", 2, scene=scenes[0]) in ([], bakes)
        until(lambda: walked(client, "bakes", "bakes", 2, state="done") == bakes)
        assert walked(client, "bakes", "bakes", 2, state="failed") == []
        assert len(walked(client, "scenes", "scenes", 2, name="TOWN")) >= 5
        assert walked(client, "scenes", "scenes", 2, name="village") == []


def test_ready(tmp_path: Path) -> None:
    app = app_over(tmp_path / "store")
    with TestClient(app, base_url=f"http://test{API}/") as client:
        assert client.get("ready").status_code == 200
        app.state.stopping = True
        assert client.get("ready").status_code == 503
        assert client.get("health").status_code == 200


def test_numbers(tmp_path: Path) -> None:
    with client_over(tmp_path / "store", **{"c1_0_0": "error"}) as client:
        bake = start_bake(client, 3)
        until(lambda: client.get(f"bakes/{bake}").json()["state"] in ("done", "failed"))
        text = client.get("http://test/metrics").text
    assert 'farfield_cells_total{outcome="done"} ' in text
    route = 'method="GET",route="/bakes/{bake}",status="200"'
    assert f"farfield_requests_total{{{route}}}" in text
    # never by address
    assert bake not in text


def test_log_lines_have_ids(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "farfield")
    with client_over(tmp_path / "store") as client:
        bake = start_bake(client, 2)
        until(lambda: client.get(f"bakes/{bake}").json()["state"] == "done")
        answer = client.get(f"bakes/{bake}", headers={"X-Request-Id": "mine-1"})
        assert answer.headers["x-request-id"] == "mine-1"
        made = client.get(f"bakes/{bake}", headers={"X-Request-Id": "no good\tone"})
        assert len(made.headers["x-request-id"]) == 16
    lines = [json.loads(JsonLines().format(record)) for record in caplog.records]
    requests = [line for line in lines if line["logger"] == "farfield.request"]
    assert any(line.get("bake") == bake and line["status"] == 200 for line in requests)
    cells = [line for line in lines if line["logger"] == "farfield.cell"]
    assert {line["cell"] for line in cells if line["bake"] == bake} == {"0_0_0", "1_0_0"}


def test_traces_lead_from_the_request_to_its_cells(tmp_path: Path) -> None:
    spans = InMemorySpanExporter()
    app = app_over(tmp_path / "store", tracing=Tracing("", SimpleSpanProcessor(spans)))
    with TestClient(app, base_url=f"http://test{API}/") as client:
        bake = start_bake(client, 3)
        until(lambda: client.get(f"bakes/{bake}").json()["state"] == "done")
        until(lambda: len([s for s in spans.get_finished_spans() if s.name[:5] == "cell "]) == 3)
    found = spans.get_finished_spans()
    (asked,) = [span for span in found if span.name == "POST /bakes"]
    for cell in (span for span in found if span.name.startswith("cell ")):
        assert cell.parent is not None
        assert cell.parent.span_id == asked.context.span_id
        assert cell.context.trace_id == asked.context.trace_id
        assert cell.attributes is not None
        assert cell.attributes["farfield.bake"] == bake
