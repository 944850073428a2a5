"""The farm with a real Redis and real workers, which are killed, flushed and lied to."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from farfield_core.bake import done_cells
from farfield_core.control import write_control
from farfield_core.dispatch import Event
from farfield_core.dispatch.celery import CeleryDispatcher
from farfield_core.dispatch.queues import CELLS
from farfield_core.store import Store
from fastapi.testclient import TestClient
from redis import Redis

from tests.integration.serving import API, ready_scene, row, until
from tests.unit.walks import row_of_cells

WORKER = Path(__file__).with_name("farm_worker.py")
REDIS = shutil.which("redis-server")
#: how often the same is done to a farm: `make soak` does it for longer
ROUNDS = 20 if os.environ.get("FARFIELD_SOAK") == "1" else 1


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@pytest.fixture(scope="module")
def redis_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a Redis of our own."""
    assert REDIS, "redis-server is needed; make setup installs it"
    port = free_port()
    options = ["--port", str(port), "--bind", "127.0.0.1", "--save", "", "--appendonly", "no"]
    folder = tmp_path_factory.mktemp("redis")
    with subprocess.Popen([REDIS, *options, "--dir", folder], stdout=subprocess.DEVNULL) as server:
        broker = f"redis://127.0.0.1:{port}/0"
        with Redis.from_url(broker) as client:
            until(lambda: answers(client))
        yield broker
        server.terminate()


def answers(client: Redis) -> bool:
    try:
        return bool(client.ping())
    except ConnectionError:
        return False
    except Exception as error:
        return "refused" not in str(error)


@pytest.fixture
def broker(redis_server: str) -> str:
    with Redis.from_url(redis_server) as client:
        client.flushall()
    return redis_server


@contextmanager
def worker(broker: str, store: Path, **fake: Any) -> Iterator[subprocess.Popen[bytes]]:
    """A worker with two processes; `fake` is as in `serving.app_over`."""
    behaviour = {"FAKE": json.dumps({k.removeprefix("c"): v for k, v in fake.items()})}
    log = store.parent / f"worker-{time.monotonic_ns()}.log"
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, WORKER, broker, store],
            env={**os.environ, **behaviour},
            cwd=WORKER.parents[2],
            stdout=out,
            stderr=out,
            start_new_session=True,
        )
        try:
            until(lambda: b"ready." in log.read_bytes() or process.poll() is not None)
            assert process.poll() is None, log.read_text()
            yield process
        finally:
            kill(process)
    assert "Traceback" not in log.read_text() or fake, log.read_text()


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a worker with all its processes, as a machine that loses its power."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def feeder(
    store: Path, broker: str, **options: Any
) -> Iterator[tuple[CeleryDispatcher, list[Event]]]:
    events: list[Event] = []
    dispatcher = CeleryDispatcher(
        Store.open(store), broker, events.append, interval=0.1, **{"patience": 1.5, **options}
    )
    try:
        yield dispatcher, events
    finally:
        dispatcher.close()


def attempts(store: Path) -> Counter[str]:
    return Counter(path.name.split("-")[0] for path in (store / "attempts").iterdir())


def test_every_cell_is_baked_once(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 6)
    with worker(broker, store), feeder(store, broker, patience=60) as (dispatcher, events):
        dispatcher.submit(walk.id)
        status = dispatcher.wait(walk.id, timeout=30)
        assert (status.state, status.done, status.failed, status.running) == ("done", 6, 0, 0)
        until(lambda: events and events[-1].state == "done")
    assert attempts(store) == Counter({f"{i}_0_0": 1 for i in range(6)})
    assert sorted(e.cell for e in events if e.kind == "done" and e.cell) == sorted(attempts(store))
    assert [e.state for e in events if e.kind == "state"][-1] == "done"


def test_a_cell_that_keeps_failing_is_given_up_with_its_reason(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 4)
    fake = {"c1_0_0": "error", "c2_0_0": "crash"}
    with worker(broker, store, **fake), feeder(store, broker) as (dispatcher, _):
        dispatcher.submit(walk.id)
        status = dispatcher.wait(walk.id, timeout=30)
        assert (status.state, status.done, status.failed) == ("failed", 2, 2)
        assert "The cell is cursed." in status.reasons["1_0_0"]
        assert "SIGSEGV" in status.reasons["2_0_0"]
        assert attempts(store)["1_0_0"] == attempts(store)["2_0_0"] == 3
    with worker(broker, store), feeder(store, broker) as (dispatcher, _):
        dispatcher.submit(walk.id)
        assert dispatcher.wait(walk.id, timeout=30).state == "done"


def test_a_pool_process_that_dies_blames_its_cell_only(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 4)
    with (
        worker(broker, store, **{"c*": 1.0}) as process,
        feeder(store, broker) as (dispatcher, _),
    ):
        dispatcher.submit(walk.id)
        until(lambda: (store / "attempts").is_dir() and attempts(store))
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        os.kill(int(children[-1]), signal.SIGKILL)
        assert dispatcher.wait(walk.id, timeout=30).state == "done"


def test_a_lost_worker_costs_its_cells_a_second_try(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 6 * ROUNDS)
    with ExitStack() as stack:
        dispatcher, _ = stack.enter_context(feeder(store, broker))
        dispatcher.submit(walk.id)
        for _ in range(ROUNDS):
            before = dispatcher.status(walk.id).done
            lost = stack.enter_context(worker(broker, store, **{"c*": 0.5}))
            until(lambda before=before: dispatcher.status(walk.id).done > before)
            kill(lost)
            assert dispatcher.status(walk.id).state == "running"
        stack.enter_context(worker(broker, store))
        assert dispatcher.wait(walk.id, timeout=30).state == "done"


def test_losing_redis_loses_nothing(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 20 * ROUNDS)
    with (
        worker(broker, store, **{"c*": 0.1}),
        feeder(store, broker) as (dispatcher, _),
        Redis.from_url(broker) as redis,
    ):
        dispatcher.submit(walk.id)
        for round_ in range(ROUNDS):
            until(lambda count=20 * round_ + 2: dispatcher.status(walk.id).done >= count)
            redis.flushall()
        assert dispatcher.wait(walk.id, timeout=30).state == "done"
    assert len(done_cells(Store.open(store), walk.id)) == 20 * ROUNDS


def test_pausing_empties_the_queue_and_cancelling_too(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 30)
    with (
        worker(broker, store, **{"c*": 0.3}),
        feeder(store, broker) as (dispatcher, _),
        Redis.from_url(broker) as redis,
    ):
        dispatcher.submit(walk.id)
        until(lambda: dispatcher.status(walk.id).done >= 1)
        dispatcher.pause(walk.id)
        assert redis.llen(CELLS) == 0
        time.sleep(1)  # what was under way is finished
        before = len(done_cells(Store.open(store), walk.id))
        time.sleep(1)
        assert len(done_cells(Store.open(store), walk.id)) == before < 30
        assert dispatcher.status(walk.id).state == "paused"
        dispatcher.resume(walk.id)
        until(lambda: dispatcher.status(walk.id).done > before)
        dispatcher.cancel(walk.id)
        assert redis.llen(CELLS) == 0
        assert dispatcher.status(walk.id).state == "cancelled"


def test_the_queue_stays_short(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    walk = row_of_cells(Store.open(store), 500)
    with (
        feeder(store, broker, queue_limit=20) as (dispatcher, _),
        Redis.from_url(broker) as redis,
    ):
        dispatcher.submit(walk.id)
        until(lambda: redis.llen(CELLS) == 20)
        time.sleep(0.5)
        assert redis.llen(CELLS) == 20
        assert dispatcher.status(walk.id).running == 20


def test_a_walker_overtakes_the_queue(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    opened = Store.open(store)
    walk = row_of_cells(opened, 40)
    with feeder(store, broker, patience=60) as (dispatcher, _), Redis.from_url(broker) as redis:
        dispatcher.submit(walk.id)
        until(lambda: redis.llen(CELLS) == 40)
        dispatcher.first(walk.id, ["5_0_0"])
        dispatcher.first(walk.id, ["30_0_0", "31_0_0"])
        with worker(broker, store, **{"c*": 0.3}):
            until(lambda: (store / "attempts").is_dir() and len(attempts(store)) >= 3)
            began = sorted((store / "attempts").iterdir(), key=lambda p: p.stat().st_mtime_ns)
    assert {path.name.split("-")[0] for path in began[:2]} == {"30_0_0", "31_0_0"}


def test_a_worker_leaves_cells_of_a_paused_bake(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    opened = Store.open(store)
    walk = row_of_cells(opened, 2)
    write_control(opened, walk.id, "paused")
    with feeder(store, broker) as (dispatcher, _), Redis.from_url(broker) as redis:
        dispatcher.submit(walk.id)
        until(lambda: redis.llen(CELLS) == 2)
        with worker(broker, store):
            until(lambda: redis.llen(CELLS) == 0)
            time.sleep(0.5)
    assert done_cells(opened, walk.id) == set()


def test_an_api_of_a_farm(broker: str, tmp_path: Path) -> None:
    store = tmp_path / "store"
    app = create_app(ApiSettings(store=str(store), broker=broker, web=tmp_path))
    with worker(broker, store), TestClient(app, base_url=f"http://test{API}/") as client:
        assert client.get("health").json()["dispatch"] == "farm"
        body = {"scene": ready_scene(client), "corridor": row(3), "settings": {"layers": 4}}
        bake = client.post("bakes", json=body).json()["id"]
        until(lambda: client.get(f"bakes/{bake}").json()["state"] == "done")
        cells = client.get(f"walks/{bake}/cells").json()["cells"]
        assert sorted(cells) == ["0_0_0", "1_0_0", "2_0_0"]


def test_the_command_says_whether_a_worker_answers(broker: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "farfield", "worker", "--ping", "--broker", broker]
    alone = subprocess.run(command, capture_output=True, text=True, check=False)
    assert alone.returncode != 0
    assert alone.stderr == "No worker on this machine answers.\n"
    with worker(broker, tmp_path / "store"):
        assert subprocess.run(command, check=False).returncode == 0


def test_a_worker_needs_a_broker() -> None:
    command = [sys.executable, "-m", "farfield", "worker", "--broker", ""]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 2
    assert "--broker" in answer.stderr
