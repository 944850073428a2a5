"""Parts of the farm are killed, emptied and lied to, around a real Redis and a real S3 server.

`make soak` (FARFIELD_SOAK=1) runs the full sizes of the promise: 300 cells, a worker killed every
5 s, a store that is gone for 30 s. Otherwise the same is done to fewer cells.
"""

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from farfield_core.bake import create_bake
from farfield_core.corridor import parse_corridor
from farfield_core.dispatch.celery import CeleryDispatcher
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.walk import Walk
from redis import Redis

from tests.integration.farm import Farm, children, kill
from tests.integration.servers import (
    BUCKET,
    Faults,
    MotoServer,
    RedisServer,
    S3Server,
    running,
    s3_environment,
    s3_server,
)
from tests.integration.serving import until
from tests.unit.walks import row_of_cells, scene_info

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
CELLS = 300 if SOAK else 36
#: seconds that a stand-in cell takes, and in which all cells of a test have to be done
CELL, ENOUGH = (1.0, 900) if SOAK else (0.3, 240)


@pytest.fixture
def redis(tmp_path: Path) -> Iterator[RedisServer]:
    """A Redis of the test's own, to be killed."""
    folder = tmp_path / "redis"
    folder.mkdir()
    server = RedisServer(folder)
    with running(server):
        yield server


@pytest.fixture(scope="module")
def s3(tmp_path_factory: pytest.TempPathFactory) -> Iterator[S3Server | MotoServer]:
    server = s3_server(tmp_path_factory.mktemp("s3"))
    with running(server):
        yield server


@pytest.fixture
def faults(s3: S3Server | MotoServer) -> Iterator[Faults]:
    # clients wait for 10 s
    proxy = Faults(s3.port, silence=30 if SOAK else 3)
    yield proxy
    proxy.close()


@pytest.fixture
def farm(
    redis: RedisServer, faults: Faults, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Farm]:
    """A farm over S3; whatever it asks of the store passes the proxy."""
    for name, value in s3_environment(faults.endpoint).items():
        monkeypatch.setenv(name, value)
    with Farm(redis.url, f"s3://{BUCKET}/{tmp_path.name}", tmp_path) as farm:
        yield farm


def begun(farm: Farm, **options: object) -> tuple[Walk, CeleryDispatcher]:
    """A bake that is under way."""
    walk = row_of_cells(farm.store, CELLS)
    dispatcher, _ = farm.feeder(**options)
    dispatcher.submit(walk.id)
    return walk, dispatcher


def assert_done(
    farm: Farm, walk: Walk, dispatcher: CeleryDispatcher, seconds: float = ENOUGH
) -> None:
    status = dispatcher.wait(walk.id, timeout=seconds)
    assert (status.state, status.done, status.failed) == ("done", CELLS, 0), status
    farm.assert_intact(walk.id, CELLS)


def usual(dispatcher: CeleryDispatcher, walk: Walk) -> float:
    """Seconds that two processes take for what is left, with a fifth for handing cells out."""
    return 1.2 * CELL * (CELLS - dispatcher.status(walk.id).done) / 2


def test_workers_killed_again_and_again(farm: Farm) -> None:
    walk, dispatcher = begun(farm, patience=5.0)
    workers = [farm.worker(1, wait=False, **{"*": CELL}) for _ in range(2)]
    for worker in workers:
        farm.ready(worker)
    kills = 0
    while dispatcher.status(walk.id).state != "done" and (SOAK or kills < 4):
        if SOAK:
            time.sleep(5)
        else:
            until(lambda count=5 * kills + 3: dispatcher.status(walk.id).done >= count)
        kill(workers.pop(0))
        kills += 1
        workers.append(farm.worker(1, wait=False, **{"*": CELL}))
    assert kills >= 4
    assert_done(farm, walk, dispatcher)
    twice = sum(count - 1 for count in farm.finished().values())
    assert twice < 0.1 * CELLS
    # what a killed worker had begun is begun again, and nothing else
    assert sum(farm.attempts().values()) <= CELLS + kills + twice


def test_redis_is_killed_and_comes_back(farm: Farm, redis: RedisServer) -> None:
    walk, dispatcher = begun(farm)
    farm.worker(2, **{"*": CELL})
    until(lambda: dispatcher.status(walk.id).done >= 4)
    redis.kill()
    time.sleep(5 if SOAK else 2)
    redis.start()
    assert_done(farm, walk, dispatcher, usual(dispatcher, walk) + 60)
    assert sum(farm.finished().values()) < 1.1 * CELLS


def test_redis_is_emptied(farm: Farm, redis: RedisServer) -> None:
    walk, dispatcher = begun(farm)
    farm.worker(2, **{"*": CELL})
    for round_ in range(10 if SOAK else 2):
        until(lambda count=4 + 10 * round_: dispatcher.status(walk.id).done >= count)
        redis.flush()
    assert_done(farm, walk, dispatcher, usual(dispatcher, walk) + 60)
    assert sum(farm.finished().values()) < 1.1 * CELLS


def test_the_store_fails_one_call_in_ten_and_is_gone(farm: Farm, faults: Faults) -> None:
    walk, dispatcher = begun(farm)
    faults.share = 0.1
    farm.worker(2, **{"*": CELL})
    until(lambda: dispatcher.status(walk.id).done >= 4)
    faults.gone = True
    time.sleep(30 if SOAK else 4)
    faults.gone = False
    dispatcher.wait(walk.id, timeout=ENOUGH)
    faults.share = 0.0  # files are looked at through a store that answers
    assert_done(farm, walk, dispatcher)
    assert faults.faults > 0


def test_all_of_it_is_killed_and_started_anew(
    farm: Farm, redis: RedisServer, s3: S3Server | MotoServer
) -> None:
    """The lights go out, and come back with an empty Redis."""
    walk, dispatcher = begun(farm)
    worker = farm.worker(2, **{"*": CELL})
    until(lambda: dispatcher.status(walk.id).done >= 4)
    kill(worker)
    dispatcher.close()
    redis.kill()
    if isinstance(s3, S3Server):  # moto would forget what was done
        s3.kill()
        s3.start()
    redis.start()
    redis.flush()
    farm.store = Store.open(farm.url)
    fresh, _ = farm.feeder()
    fresh.submit(walk.id)
    assert fresh.status(walk.id).done >= 4
    farm.worker(2, **{"*": CELL})
    assert_done(farm, walk, fresh)
    assert max(farm.finished().values()) == 1


def test_what_a_cell_costs_redis_and_s3(
    farm: Farm, faults: Faults, record_testsuite_property: Callable[[str, object], None]
) -> None:
    """What the farm takes for a cell that costs nothing: operations, and processor time.

    A cell of the demo city takes 0.9 s of a processor with layers and 7 s with slanted quads
    (farfield_core.plan); the farm is to add less than a twentieth of that.
    """
    walk = row_of_cells(farm.store, CELLS)
    worker = farm.worker(1, **{"*": 0})
    processes = [worker.pid, *children(worker)]
    taken = processor_seconds(processes) + time.process_time()
    dispatcher, _ = farm.feeder(interval=0.5)
    with Redis.from_url(farm.broker) as client:
        commands, requests = client.info("stats")["total_commands_processed"], faults.requests
        dispatcher.submit(walk.id)
        assert_done(farm, walk, dispatcher)
        commands = (client.info("stats")["total_commands_processed"] - commands) / CELLS
    requests = (faults.requests - CELLS - requests) / CELLS  # CELLS of them were the check's own
    taken = (processor_seconds(processes) + time.process_time() - taken) / CELLS
    record_testsuite_property("processor_seconds_a_cell", taken)
    record_testsuite_property("redis_commands_a_cell", commands)
    record_testsuite_property("s3_requests_a_cell", requests)
    assert commands < 60
    assert requests < 6
    assert taken < 0.05 * 0.9


@pytest.mark.alone
def test_two_workers_bake_twice_as_fast_as_one(
    farm: Farm, record_testsuite_property: Callable[[str, object], None]
) -> None:
    """In the soak on processor time; otherwise cells only wait, as a busy machine has none left."""
    act = "burn 0.5" if SOAK else "0.5"
    seconds = []
    for count in (1, 2):
        # a bake of its own, for cells are baked once
        corridor = parse_corridor({"box": {"min": [0, 0, 0], "max": [240, 10, 10 * count]}})
        walk = create_bake(farm.store, scene_info(), corridor, BakeSettings(resolution=64))
        farm.worker(1, **{"*": act})
        dispatcher, events = farm.feeder()
        until(lambda n=count, d=dispatcher: len({slot.worker for slot in d.slots()}) == n)
        dispatcher.submit(walk.id)
        until(lambda e=events: any(event.kind == "done" for event in e))
        began, first = time.monotonic(), dispatcher.status(walk.id).done
        assert dispatcher.wait(walk.id, timeout=ENOUGH).state == "done"
        seconds.append((time.monotonic() - began) / (24 * count - first))
    record_testsuite_property("two_workers_to_one", seconds[0] / seconds[1])
    assert seconds[0] / seconds[1] > 1.7


def processor_seconds(processes: list[int]) -> float:
    """Processor time that processes have taken."""
    total = 0
    for process in processes:
        words = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(") ", 1)[1].split()
        total += int(words[11]) + int(words[12])
    return total / os.sysconf("SC_CLK_TCK")
