"""The life of a bake over HTTP, with processes that take their time, fail and crash."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from farfield_core.bake import done_cells, predecessor
from farfield_core.store import Store
from fastapi.testclient import TestClient

from tests.integration.serving import (
    client_over,
    problem,
    ready_scene,
    row,
    start_bake,
    state,
    until,
)
from tests.unit.walks import row_of_cells


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "store"


@pytest.fixture
def slow(store: Path) -> Iterator[TestClient]:
    with client_over(store, **{"c*": 0.3}) as client:
        yield client


def done(client: TestClient, bake: str) -> int:
    return int(client.get(f"bakes/{bake}").json()["cells"]["done"])


def test_a_bake_is_done_when_every_cell_exists(store: Path) -> None:
    with client_over(store, **{"c*": 0.05}) as client:
        bake = start_bake(client)
        body = until(lambda: (b := client.get(f"bakes/{bake}").json())["state"] == "done" and b)
        assert body["cells"] == {"total": 4, "done": 4, "failed": 0}
        assert body["failures"] == []
        assert body["seconds_left"] is None
        assert client.get("bakes").json() == {"bakes": [body], "next": None}
    assert len(done_cells(Store.open(store), bake)) == 4


def test_asking_twice_is_asking_once(slow: TestClient) -> None:
    assert start_bake(slow) == start_bake(slow)
    assert len(slow.get("bakes").json()["bakes"]) == 1


def test_pause_and_resume(slow: TestClient) -> None:
    bake = start_bake(slow)
    until(lambda: done(slow, bake) >= 1)
    assert slow.post(f"bakes/{bake}/pause").json()["state"] == "paused"
    time.sleep(0.5)  # what was under way is finished
    before = done(slow, bake)
    time.sleep(0.7)
    assert done(slow, bake) == before < 4
    assert slow.post(f"bakes/{bake}/pause").status_code == 200
    assert slow.post(f"bakes/{bake}/resume").json()["state"] in ("queued", "running")
    until(lambda: state(slow, bake) == "done")


def test_cancel_keeps_what_is_done_and_can_be_taken_back(slow: TestClient, store: Path) -> None:
    bake = start_bake(slow)
    until(lambda: done(slow, bake) >= 1)
    assert slow.post(f"bakes/{bake}/cancel").json()["state"] == "cancelled"
    kept = done_cells(Store.open(store), bake)
    assert 1 <= len(kept) < 4
    time.sleep(0.5)
    assert done_cells(Store.open(store), bake) == kept
    slow.post(f"bakes/{bake}/resume")
    until(lambda: state(slow, bake) == "done")


def test_posting_a_cancelled_bake_again_resumes_it(slow: TestClient) -> None:
    bake = start_bake(slow)
    slow.post(f"bakes/{bake}/cancel")
    assert start_bake(slow) == bake
    until(lambda: state(slow, bake) == "done")


def test_failed_cells_are_listed_and_retried(store: Path) -> None:
    with client_over(store, c1_0_0="error") as client:
        bake = start_bake(client)
        body = until(lambda: (b := client.get(f"bakes/{bake}").json())["state"] == "failed" and b)
        assert body["cells"] == {"total": 4, "done": 3, "failed": 1}
        assert [f["cell"] for f in body["failures"]] == ["1_0_0"]
        assert "The cell is cursed." in body["failures"][0]["reason"]
    # Another server lists it as well, does not try by itself, and tries when told to.
    with client_over(store) as client:
        assert client.get(f"bakes/{bake}").json() == body
        time.sleep(0.5)
        assert state(client, bake) == "failed"
        assert client.post(f"bakes/{bake}/retry").status_code == 200
        until(lambda: state(client, bake) == "done")


def test_a_restarted_server_goes_on(store: Path) -> None:
    with client_over(store, **{"c*": 0.3}) as client:
        bake = start_bake(client)
        until(lambda: done(client, bake) >= 1)
    assert len(done_cells(Store.open(store), bake)) < 4
    with client_over(store) as client:
        until(lambda: state(client, bake) == "done")


def test_a_paused_bake_stays_paused_after_a_restart(store: Path) -> None:
    with client_over(store, **{"c*": 0.3}) as client:
        bake = start_bake(client)
        client.post(f"bakes/{bake}/pause")
    with client_over(store) as client:
        time.sleep(0.5)
        assert state(client, bake) == "paused"
        client.post(f"bakes/{bake}/resume")
        until(lambda: state(client, bake) == "done")


def test_cells_near_the_walker_come_first(slow: TestClient) -> None:
    bake = start_bake(slow, cells=12)
    until(lambda: done(slow, bake) >= 1)
    assert slow.post(f"bakes/{bake}/focus", json={"cell": [8, 0, 0]}).status_code == 204
    until(lambda: done(slow, bake) >= 5)
    names = slow.get(f"walks/{bake}/cells").json()["cells"]
    # Two cells may have been done or under way before the walker was heard of.
    near = {int(name.split("_")[0]) for name in names[2:5]}
    assert near <= {6, 7, 8, 9, 10}


def test_a_cell_that_is_asked_for_comes_first(slow: TestClient) -> None:
    bake = start_bake(slow, cells=12)
    until(lambda: done(slow, bake) >= 1)
    asked = f"walks/{bake}/cells/9_0_0.json"
    problem(slow.get(asked), 404)
    until(lambda: slow.get(asked).status_code == 200)
    assert done(slow, bake) <= 5


def test_focus_outside_the_corridor(slow: TestClient) -> None:
    bake = start_bake(slow)
    assert "99_0_0" in problem(slow.post(f"bakes/{bake}/focus", json={"cell": [99, 0, 0]}), 404)


def test_a_bake_of_the_command_line_is_watched(store: Path) -> None:
    opened = Store.open(store)
    walk = row_of_cells(opened, 3)
    with client_over(store) as client:
        body = client.get(f"bakes/{walk.id}").json()
        assert (body["state"], body["cells"]["done"]) == ("paused", 0)
        for i in range(3):
            opened.put_new(f"bakes/{walk.id}/cells/{i}_0_0.json", b"{}")
        until(lambda: state(client, walk.id) == "done")
        assert client.get(f"walks/{walk.id}/cells").json() == {
            "cells": ["0_0_0", "1_0_0", "2_0_0"],
            "next": None,
        }


@pytest.mark.parametrize("verb", ["pause", "resume", "cancel", "retry"])
def test_a_finished_bake_has_nothing_left_to_do(store: Path, verb: str) -> None:
    with client_over(store) as client:
        bake = start_bake(client, cells=1)
        until(lambda: state(client, bake) == "done")
        assert "nothing to" in problem(client.post(f"bakes/{bake}/{verb}"), 409)
        assert state(client, bake) == "done"


@pytest.mark.parametrize("verb", ["pause", "resume", "cancel", "retry", "focus"])
def test_there_is_no_such_bake(slow: TestClient, verb: str) -> None:
    answer = slow.post(f"bakes/nosuchbake/{verb}", json={"cell": [0, 0, 0]})
    assert "nosuchbake" in problem(answer, 404)


def test_ids_are_checked_before_anything_is_looked_up(slow: TestClient) -> None:
    for name in ("..", "a..b", "A", "a/b", "%2e%2e", "x" * 65, "-a"):
        assert slow.get(f"bakes/{name}").status_code in (404, 422)


def test_baking_needs_a_prepared_scene(slow: TestClient) -> None:
    problem(slow.post("bakes", json={"scene": "nosuchscene", "corridor": row(1)}), 404)


def test_a_bake_may_follow_one_of_the_scene_before_an_edit(store: Path) -> None:
    with client_over(store) as client:
        first = start_bake(client)
        body = {"scene": ready_scene(client), "corridor": row(4), "settings": {"layers": 5}}
        second = client.post("bakes", json={**body, "follows": first}).json()["id"]
        assert predecessor(Store.open(store), second) == first
        answer = client.post("bakes", json={**body, "follows": "0" * 16})
        assert problem(answer, 404) == f"There is no bakes/{'0' * 16}/walk.json in the store."
        assert client.post("bakes", json={**body, "follows": "../"}).status_code == 422
