"""The farm with a real Redis and real workers: what it bakes, in which order, and how it stops."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from farfield_core.bake import done_cells
from farfield_core.control import write_control
from farfield_core.dispatch.board import Board
from farfield_core.dispatch.queues import CELLS
from fastapi.testclient import TestClient
from redis import Redis

from tests.integration.farm import Farm, children
from tests.integration.servers import RedisServer, running
from tests.integration.serving import API, ready_scene, row, until, upload
from tests.unit.walks import row_of_cells


@pytest.fixture(scope="module")
def redis_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RedisServer]:
    server = RedisServer(tmp_path_factory.mktemp("redis"))
    with running(server):
        yield server


@pytest.fixture
def farm(redis_server: RedisServer, tmp_path: Path) -> Iterator[Farm]:
    """A farm over a folder, and an empty Redis."""
    redis_server.flush()
    with Farm(redis_server.url, str(tmp_path / "store"), tmp_path) as farm:
        yield farm


def queued(farm: Farm) -> int:
    with Redis.from_url(farm.broker) as redis:
        return int(redis.llen(CELLS))


def test_every_cell_is_baked_once(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 6)
    farm.worker()
    dispatcher, events = farm.feeder()
    dispatcher.submit(walk.id)
    status = dispatcher.wait(walk.id, timeout=60)
    assert (status.state, status.done, status.failed, status.running) == ("done", 6, 0, 0)
    until(lambda: events and events[-1].state == "done")
    assert farm.attempts() == farm.finished() | farm.attempts()
    assert farm.finished() == Counter({f"{i}_0_0": 1 for i in range(6)})
    done = [event for event in events if event.kind == "done"]
    assert sorted(str(event.cell) for event in done) == sorted(farm.finished())
    assert [e.state for e in events if e.kind == "state"][-1] == "done"
    farm.assert_intact(walk.id, 6)


def test_poison_fails_alone_and_says_why(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 8)
    poison = {"c1_0_0": "error", "c2_0_0": "crash", "c3_0_0": "hang", "c4_0_0": "fill"}
    limits = {"FARFIELD_CELL_SECONDS": "3", "FARFIELD_CELL_MEGABYTES": "250"}
    farm.workers(3, limits, **poison)
    dispatcher, events = farm.feeder(patience=5.0)
    dispatcher.submit(walk.id)
    status = dispatcher.wait(walk.id, timeout=90)
    assert (status.state, status.done, status.failed) == ("failed", 4, 4)
    assert sorted(status.reasons) == ["1_0_0", "2_0_0", "3_0_0", "4_0_0"]
    assert "The cell is cursed." in status.reasons["1_0_0"]
    assert "killed by SIGSEGV; its last words: the driver gave up" in status.reasons["2_0_0"]
    assert "The process gave no answer for 3 s." in status.reasons["3_0_0"]
    assert "The process took more than 250 MB of memory." in status.reasons["4_0_0"]
    assert all("(tried 3 times by 3 workers)" in why for why in status.reasons.values())
    assert all(farm.attempts()[f"{i}_0_0"] == 3 for i in (1, 2, 3, 4))
    assert all(farm.attempts()[f"{i}_0_0"] == 1 for i in (0, 5, 6, 7))
    retried = [event.cell for event in events if event.kind == "retried"]
    assert Counter(retried) == Counter({f"{i}_0_0": 2 for i in (1, 2, 3, 4)})
    assert dispatcher.aside() == {}


def test_where_there_is_one_worker_it_tries_three_times(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 2)
    lone = farm.worker(c1_0_0="error")
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    status = dispatcher.wait(walk.id, timeout=60)
    assert (status.state, status.done, status.failed) == ("failed", 1, 1)
    assert status.reasons["1_0_0"] == "The cell is cursed. (tried 3 times)"
    lone.send_signal(signal.SIGKILL)
    farm.worker()
    dispatcher.retry(walk.id)
    assert dispatcher.wait(walk.id, timeout=60).state == "done"


def test_a_worker_that_fails_what_others_bake_is_set_aside(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 12)
    bad, good = (farm.worker(1, wait=False, **{"*": act}) for act in ("error", "0.2"))
    farm.ready(bad)
    farm.ready(good)
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    assert dispatcher.wait(walk.id, timeout=60).state == "done"
    until(lambda: len(dispatcher.aside()) == 1)
    assert list(dispatcher.aside().values()) == [
        "Other workers baked cells that this one could not."
    ]


def test_workers_on_which_nothing_starts_blame_no_cell(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 4)
    farm.worker(1, {"FAKE_START": "crash"})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: dispatcher.status(walk.id).reason)
    reason = str(dispatcher.status(walk.id).reason)
    assert reason.startswith("All workers were set aside. Baking could not begin.")
    assert "no GL library was found" in reason
    assert dispatcher.status(walk.id).failed == 0
    farm.worker(1)
    assert dispatcher.wait(walk.id, timeout=60).state == "done"


def test_a_pool_process_that_dies_blames_its_cell_only(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 4)
    worker = farm.worker(**{"*": 1.0})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    until(farm.attempts)
    os.kill(children(worker)[-1], signal.SIGKILL)
    assert dispatcher.wait(walk.id, timeout=60).state == "done"
    assert set(farm.finished().values()) == {1}


def test_nothing_outlives_a_killed_worker(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 2)
    worker = farm.worker(**{"*": "hang"})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: len(farm.attempts()) == 2)
    pool = children(worker)
    bakers = [child for process in pool for child in _children_of(process)]
    assert len(bakers) == 2
    os.kill(worker.pid, signal.SIGKILL)  # the parent only
    worker.wait()
    until(lambda: not any(Path(f"/proc/{p}/cmdline").exists() for p in (*pool, *bakers)))


def _children_of(process: int) -> list[int]:
    text = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="ascii")
    return [int(word) for word in text.split()]


def test_a_worker_told_to_stop_finishes_its_cells(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 6)
    worker = farm.worker(**{"*": 0.8})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: len(farm.attempts()) == 2)
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(timeout=30) == 0
    assert farm.attempts() == Counter(dict.fromkeys(farm.finished(), 1))
    with Redis.from_url(farm.broker) as redis:
        assert not list(redis.scan_iter("farfield:slot:*"))
    farm.worker()
    assert dispatcher.wait(walk.id, timeout=60).state == "done"
    assert set(farm.attempts().values()) == {1}


def test_pausing_empties_the_queue(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 30)
    farm.worker(**{"*": 0.3})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: dispatcher.status(walk.id).done >= 1)
    dispatcher.pause(walk.id)
    assert queued(farm) == 0
    time.sleep(1)  # what was under way is finished
    before = len(done_cells(farm.store, walk.id))
    time.sleep(1)
    assert len(done_cells(farm.store, walk.id)) == before < 30
    assert dispatcher.status(walk.id).state == "paused"
    dispatcher.resume(walk.id)
    until(lambda: dispatcher.status(walk.id).done > before)


def test_cancelling_stops_within_two_seconds(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 30)
    farm.worker(**{"*": "hang"})
    dispatcher, events = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: len(farm.attempts()) == 2)
    until(lambda: len([slot for slot in dispatcher.slots() if slot.cell]) == 2)
    dispatcher.cancel(walk.id)
    began = time.monotonic()
    assert queued(farm) == 0
    assert dispatcher.status(walk.id).state == "cancelled"
    until(lambda: not any(slot.cell for slot in dispatcher.slots()))
    assert time.monotonic() - began < 2
    assert not [e for e in events if e.kind in ("retried", "failed")]
    assert len(farm.attempts()) == 2


def test_the_queue_stays_short(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 500)
    dispatcher, _ = farm.feeder(queue_limit=20)
    dispatcher.submit(walk.id)
    until(lambda: queued(farm) == 20)
    time.sleep(2)  # longer than the feeder's patience
    assert queued(farm) == 20
    assert dispatcher.status(walk.id).running == 20


def test_a_walker_overtakes_the_queue(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 40)
    dispatcher, events = farm.feeder()
    dispatcher.submit(walk.id)
    until(lambda: queued(farm) == 40)
    dispatcher.first(walk.id, ["5_0_0"])
    dispatcher.first(walk.id, ["30_0_0", "31_0_0"])
    farm.worker(**{"*": 0.3})
    until(lambda: len([e for e in events if e.kind == "done"]) >= 4)
    done = [event.cell for event in events if event.kind == "done"]
    assert set(done[:2]) == {"30_0_0", "31_0_0"}
    assert dispatcher.wait(walk.id, timeout=60).state == "done"
    assert set(farm.attempts().values()) == {1}


def test_a_worker_leaves_cells_of_a_paused_bake(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 2)
    write_control(farm.store, walk.id, "paused")
    dispatcher, _ = farm.feeder(patience=60)
    dispatcher.submit(walk.id)
    until(lambda: queued(farm) == 2)
    farm.worker()
    until(lambda: queued(farm) == 0)
    time.sleep(0.5)
    assert done_cells(farm.store, walk.id) == set()


def test_workers_tell_of_themselves(farm: Farm) -> None:
    walk = row_of_cells(farm.store, 8)
    worker = farm.worker(**{"*": 0.3})
    dispatcher, _ = farm.feeder()
    dispatcher.submit(walk.id)
    dispatcher.wait(walk.id, timeout=60)
    until(lambda: sum(slot.done for slot in dispatcher.slots()) == 8)
    slots = dispatcher.slots()
    assert len(slots) == 2
    assert {slot.process for slot in slots} == set(children(worker))
    for slot in slots:
        assert slot.renderer == "a stand-in"
        assert 0 < slot.rate < 4
        assert slot.megabytes > 5
        assert (slot.bake, slot.cell, slot.device) == ("", "", "cpu")
    board = Board(farm.broker)
    assert len(board.slots()) == 2
    board.close()


def test_an_api_of_a_farm(farm: Farm, tmp_path: Path) -> None:
    app = create_app(ApiSettings(store=farm.url, broker=farm.broker, web=tmp_path))
    farm.worker()
    with TestClient(app, base_url=f"http://test{API}/") as client:
        assert client.get("health").json()["dispatch"] == "farm"
        body = {"scene": ready_scene(client), "corridor": row(3), "settings": {"layers": 4}}
        bake = client.post("bakes", json=body).json()["id"]
        until(lambda: client.get(f"bakes/{bake}").json()["state"] == "done")
        cells = client.get(f"walks/{bake}/cells").json()["cells"]
        assert sorted(cells) == ["0_0_0", "1_0_0", "2_0_0"]


def test_a_worker_limits_what_preparing_takes(farm: Farm, tmp_path: Path) -> None:
    app = create_app(ApiSettings(store=farm.url, broker=farm.broker, web=tmp_path))
    farm.worker(env={"FARFIELD_PREPARE_SECONDS": "1"})
    with TestClient(app, base_url=f"http://test{API}/") as client:
        scene = upload(client, b"slow")
        body = until(
            lambda: (b := client.get(f"scenes/{scene}").json())["state"] != "preparing" and b
        )
        assert (body["state"], body["reason"][:36]) == (
            "refused",
            "Preparing the model took more than 1",
        )


def test_the_command_says_whether_a_worker_answers(farm: Farm) -> None:
    command = [sys.executable, "-m", "farfield", "worker", "--ping", "--broker", farm.broker]
    alone = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert alone.returncode != 0
    assert alone.stderr == "No worker on this machine answers.\n"
    farm.worker()
    until(lambda: subprocess.run(command, check=False, timeout=60).returncode == 0)


def test_a_worker_needs_a_broker() -> None:
    command = [sys.executable, "-m", "farfield", "worker", "--broker", ""]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert answer.returncode == 2
    assert "--broker" in answer.stderr
