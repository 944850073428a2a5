"""An API over a store in a folder whose cells and scenes are made by small stand-ins."""

import inspect
import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from farfield_api.app import create_app
from farfield_api.observe import Tracing
from farfield_api.service import FarfieldService
from farfield_api.settings import ApiSettings
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.dispatch.prepare import ScenePreparer
from farfield_core.store import Store
from fastapi import FastAPI
from fastapi.testclient import TestClient

TESTS = Path(__file__).parents[1]
CELL = (sys.executable, str(TESTS / "unit/fake_executor.py"))
PREPARE = (sys.executable, str(TESTS / "integration/fake_prepare.py"))
API = "/api/v1"


def app_over(
    folder: Path,
    jobs: int = 1,
    web: Path | None = None,
    settings: dict[str, Any] | None = None,
    tracing: Tracing | None = None,
    **fake: Any,
) -> FastAPI:
    """The application; `fake` maps c<i>_<j>_<k> to what happens there (fake_executor)."""
    given = ApiSettings(
        store=str(folder), web=web or folder / "no-pages", upload_limit=100_000, **settings or {}
    )
    store = Store.open(folder)
    behaviour = {"FAKE": json.dumps({k.removeprefix("c"): v for k, v in fake.items()})}
    service = FarfieldService(
        given,
        store,
        lambda listener: LocalDispatcher(
            store, jobs, listener, command=CELL, environment=behaviour
        ),
        ScenePreparer(store, PREPARE),
    )
    return create_app(given, service, tracing)


@contextmanager
def client_over(folder: Path, **how: Any) -> Iterator[TestClient]:
    """A client of `app_over`, whose work is stopped in the end."""
    with TestClient(app_over(folder, **how), base_url=f"http://test{API}/") as client:
        yield client


def until(condition: Callable[[], Any], what: str = "", seconds: float = 120) -> Any:
    """Wait until something is true, and return it; says what it waited for in vain."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > end:
            what = what or inspect.getsource(condition).strip()
            raise AssertionError(f"waited {seconds:g} s in vain for {what}")
        time.sleep(0.02)
    return value


def upload(client: TestClient, content: bytes = b"a model", name: str = "town.glb") -> str:
    """Send a model; returns the scene's id."""
    answer = client.post("scenes", files={"file": (name, content)})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def ready_scene(client: TestClient) -> str:
    """Send a model and wait until it is ready."""
    scene = upload(client)
    until(lambda: client.get(f"scenes/{scene}").json()["state"] == "ready")
    return scene


def row(cells: int) -> dict[str, Any]:
    """A corridor of cells 0_0_0, 1_0_0, ... of 10 m."""
    return {"box": {"min": [0, 0, 0], "max": [10 * cells, 10, 10]}}


def start_bake(client: TestClient, cells: int = 4, **settings: Any) -> str:
    """Send a model, ask for a bake; returns its id."""
    wanted = {"resolution": 64, "layers": 4, **settings}
    body = {"scene": ready_scene(client), "corridor": row(cells), "settings": wanted}
    answer = client.post("bakes", json=body)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def state(client: TestClient, bake: str) -> str:
    """State of a bake."""
    return str(client.get(f"bakes/{bake}").json()["state"])


def problem(answer: Any, status: int) -> str:
    """The sentence of a problem-details answer, after checking its shape."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["cache-control"] == "no-store"
    body = answer.json()
    assert set(body) == {"type", "title", "status", "detail"}
    assert body["status"] == status
    sentence = str(body["detail"])
    assert sentence.endswith(".")
    return sentence
