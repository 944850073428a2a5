"""Uploads, preparation, corridors and plans over HTTP."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from farfield_core.dispatch.prepare import ScenePreparer
from farfield_core.scenes import import_source
from farfield_core.store import Store
from fastapi.testclient import TestClient

from tests.integration.serving import (
    PREPARE,
    client_over,
    problem,
    ready_scene,
    row,
    until,
    upload,
)


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with client_over(tmp_path / "store") as client:
        yield client


def test_health(client: TestClient) -> None:
    answer = client.get("health")
    assert answer.status_code == 200
    assert answer.json() == {"status": "ok", "version": "0.1.0", "dispatch": "local"}


def test_a_scene_is_prepared(client: TestClient) -> None:
    answer = client.post("scenes", files={"file": ("slow town.glb", b"slow")})
    scene = answer.json()["id"]
    assert answer.json() == {"id": scene, "state": "preparing"}
    assert client.get(f"scenes/{scene}").json()["state"] == "preparing"
    body = until(lambda: (b := client.get(f"scenes/{scene}").json())["state"] == "ready" and b)
    assert body["name"] == "slow town"
    assert body["triangles"] == 2
    assert body["bounds"] == {"min": [-100.0, 0.0, -100.0], "max": [100.0, 0.0, 100.0]}
    assert body["notes"] == ["One line primitive was left out."]
    assert client.get("scenes").json() == {"scenes": [body], "next": None}


def test_the_prepared_scene_can_be_read_and_nothing_beside_it(client: TestClient) -> None:
    scene = upload(client, b"slow again")
    assert "still being prepared" in problem(client.get(f"scenes/{scene}/prepared/scene.json"), 409)
    until(lambda: client.get(f"scenes/{scene}").json()["state"] == "ready")
    answer = client.get(f"scenes/{scene}/prepared/scene.json")
    assert answer.json()["triangles"] == 2
    assert "immutable" in answer.headers["cache-control"]
    again = client.get(
        f"scenes/{scene}/prepared/scene.json", headers={"If-None-Match": answer.headers["etag"]}
    )
    assert (again.status_code, again.content) == (304, b"")
    positions = client.get(f"scenes/{scene}/prepared/positions.npy")
    assert np.load(io.BytesIO(positions.content)).shape == (4, 3)
    assert positions.headers["etag"] != answer.headers["etag"]
    assert client.get(f"scenes/{scene}/prepared/map.png").status_code == 404
    for name in (
        "%2e%2e/source/scene",
        "other.json",
        "textures/%2e%2e/scene.json",
        "positions.npy/x",
    ):
        assert client.get(f"scenes/{scene}/prepared/{name}").status_code in (404, 422), name


def test_the_same_bytes_are_the_same_scene(client: TestClient) -> None:
    assert upload(client, b"one") == upload(client, b"one") != upload(client, b"two")


def test_a_refused_scene_says_why(client: TestClient) -> None:
    scene = upload(client, b"refuse")
    body = until(lambda: (b := client.get(f"scenes/{scene}").json())["state"] != "preparing" and b)
    assert (body["state"], body["reason"]) == ("refused", "The model has no triangles.")
    answer = client.post("plans", json={"scene": scene, "corridor": row(2)})
    assert "no triangles" in problem(answer, 422)


def test_a_crash_refuses_the_scene(client: TestClient) -> None:
    scene = upload(client, b"crash")
    body = until(lambda: (b := client.get(f"scenes/{scene}").json())["state"] != "preparing" and b)
    assert body["state"] == "refused"
    assert "signal 11" in body["reason"]


@pytest.mark.parametrize("name", ["model.txt", "model", ".glb", "..", "glb"])
def test_what_is_no_model_file_is_refused_at_once(
    client: TestClient, tmp_path: Path, name: str
) -> None:
    problem(client.post("scenes", files={"file": (name, b"x")}), 422)
    assert [path for path in (tmp_path / "store").rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    "name",
    ["../../evil.glb", "/etc/evil.glb", "..\\..\\evil.glb", "a/../../evil.glb", "x\0y/evil.glb"],
)
def test_names_lead_nowhere_else(client: TestClient, tmp_path: Path, name: str) -> None:
    scene = upload(client, name=name)
    sources = tmp_path / "store/scenes" / scene / "source"
    assert [path.name for path in sources.iterdir()] == ["evil.glb"]
    outside = [p for p in tmp_path.rglob("*evil*") if not p.is_relative_to(tmp_path / "store")]
    assert outside == []


def test_a_file_over_the_limit_is_refused(client: TestClient, tmp_path: Path) -> None:
    answer = client.post("scenes", files={"file": ("big.glb", b"x" * 100_001)})
    assert "100000 bytes" in problem(answer, 413)
    assert not (tmp_path / "store/scenes").exists()


def test_uploads_go_on_after_a_restart(tmp_path: Path) -> None:
    model = tmp_path / "town.glb"
    model.write_bytes(b"slow")
    scene = import_source(Store.open(tmp_path / "store"), model)
    with client_over(tmp_path / "store") as client:
        until(lambda: client.get(f"scenes/{scene}").json()["state"] == "ready")


def test_corridors_are_kept_and_named(client: TestClient) -> None:
    scene = ready_scene(client)
    answer = client.post(f"scenes/{scene}/corridors", json=row(3))
    assert answer.status_code == 201
    assert answer.json()["cells"] == 3
    again = client.post(f"scenes/{scene}/corridors", json=row(3))
    assert again.json() == answer.json()
    kept = client.get(f"scenes/{scene}/corridors/{answer.json()['id']}").json()
    assert kept["box"] == row(3)["box"]
    problem(client.get(f"scenes/{scene}/corridors/{16 * '0'}"), 404)
    by_name = client.post("plans", json={"scene": scene, "corridor": answer.json()["id"]})
    inline = client.post("plans", json={"scene": scene, "corridor": row(3)})
    assert by_name.json() == inline.json()


def test_corridors_follow_the_ground(client: TestClient) -> None:
    scene = ready_scene(client)
    answer = client.post(f"scenes/{scene}/corridors", json={**row(3), "follow_ground": True})
    assert answer.json()["cells"] == 3


def test_a_plan_is_the_papers(client: TestClient) -> None:
    settings = {"cell_size": 14, "layers": 64, "resolution": 512}
    body = {"scene": ready_scene(client), "corridor": row(7), "settings": settings}
    answer = client.post("plans", json=body)
    assert answer.status_code == 200
    assert answer.json()["cells"] == 5
    assert answer.json()["near_field"] == pytest.approx(59.11, abs=0.01)


def test_planning_needs_a_prepared_scene(client: TestClient) -> None:
    scene = upload(client, b"slow")
    answer = client.post("plans", json={"scene": scene, "corridor": row(2)})
    assert "still being prepared" in problem(answer, 409)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"scene": "nosuchscene"}, "no scene"),
        ({"corridor": "0123456789abcdef"}, "no corridor"),
        ({"corridor": "../../../etc/passwd"}, "corridor"),
        ({"corridor": {}}, "exactly one"),
        ({"settings": {"layers": 0}}, "layers"),
        ({"settings": {"leyers": 3}}, "leyers"),
        ({"surplus": 1}, "surplus"),
    ],
)
def test_bad_plans(client: TestClient, change: dict[str, object], word: str) -> None:
    body = {"scene": ready_scene(client), "corridor": row(2), **change}
    answer = client.post("plans", json=body)
    assert word in problem(answer, 404 if "no" in word else 422)


def test_closing_ends_a_preparation(tmp_path: Path) -> None:
    model = tmp_path / "town.glb"
    model.write_bytes(b"slow")
    store = Store.open(tmp_path / "store")
    preparer = ScenePreparer(store, PREPARE)
    preparer.submit(import_source(store, model))
    preparer.close()
    assert [p for p in (tmp_path / "store").rglob("*") if p.name == "scene.json"] == []
