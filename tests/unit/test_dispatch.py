"""LocalDispatcher against processes that crash, hang, lie and talk nonsense."""

import json
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from farfield_core.bake import done_cells
from farfield_core.dispatch import BakeStatus, Event
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store

from tests.unit.walks import row_of_cells

FAKE = (sys.executable, str(Path(__file__).with_name("fake_executor.py")))


class Run:
    """One store, one bake of four cells, one dispatcher with a fake executor."""

    def __init__(self, folder: Path, cells: int = 4) -> None:
        self.store = Store.open(folder)
        self.walk = row_of_cells(self.store, cells)
        self.bake = self.walk.id
        self.events: list[Event] = []

    def dispatcher(
        self, jobs: int = 2, start: str | None = None, timeout: float = 60, **fake: Any
    ) -> LocalDispatcher:
        environment = {"FAKE": json.dumps({k.lstrip("c"): v for k, v in fake.items()})}
        if start:
            environment["FAKE_START"] = start
        return LocalDispatcher(
            self.store,
            jobs,
            self.events.append,
            command=FAKE,
            environment=environment,
            cell_timeout=timeout,
        )

    def bake_all(self, **how: Any) -> BakeStatus:
        with self.dispatcher(**how) as dispatcher:
            dispatcher.submit(self.bake)
            return dispatcher.wait(self.bake, timeout=60)

    def attempts(self) -> Counter[str]:
        folder = self.store.local_path("attempts")
        assert folder
        return Counter(path.name.split("-")[0] for path in folder.iterdir())

    def kinds(self, cell: str | None) -> list[str]:
        return [event.kind for event in self.events if event.cell == cell]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return Run(tmp_path / "store")


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def test_bakes_all_cells_once(run: Run) -> None:
    status = run.bake_all()
    assert status == BakeStatus("done", 4, 4, 0, 0)
    assert done_cells(run.store, run.bake) == {(i, 0, 0) for i in range(4)}
    assert run.attempts() == Counter({f"{i}_0_0": 1 for i in range(4)})
    assert run.kinds("1_0_0") == ["started", "done"]
    done = [event for event in run.events if event.kind == "done"]
    assert all(event.figures == {"seconds": 0.5, "quads": 10.0} for event in done)
    assert run.events[-1] == Event(run.bake, "state", "done")
    assert [e.state for e in run.events if e.kind == "state"].count("done") == 1


def test_a_second_run_finds_nothing_to_do(run: Run) -> None:
    run.bake_all()
    assert run.bake_all().state == "done"
    assert sum(run.attempts().values()) == 4


def test_only_missing_cells_are_baked(run: Run) -> None:
    run.store.put_new(f"bakes/{run.bake}/cells/2_0_0.json", b"{}")
    assert run.bake_all().state == "done"
    assert run.attempts() == Counter({"0_0_0": 1, "1_0_0": 1, "3_0_0": 1})


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        ("crash", "The process was killed by SIGSEGV; its last words: the driver gave up"),
        ("garbage", "something else than JSON: '%$!'"),
        ("flood", "something else than JSON"),
        ("error", "The cell is cursed."),
        ("other", "answered for '9_9_9' instead"),
        ("lie", "Cell 1_0_0 was not found in the store after it was baked."),
    ],
)
def test_a_fault_blames_its_cell_and_no_other(run: Run, act: str, reason: str) -> None:
    status = run.bake_all(c1_0_0=act)
    assert (status.state, status.done, status.failed) == ("failed", 3, 1)
    assert list(status.reasons) == ["1_0_0"]
    assert reason in status.reasons["1_0_0"]
    assert "(tried 3 times)" in status.reasons["1_0_0"]
    assert run.attempts() == Counter({"0_0_0": 1, "1_0_0": 3, "2_0_0": 1, "3_0_0": 1})
    assert run.kinds("1_0_0") == ["started", "retried"] * 2 + ["started", "failed"]
    assert run.events[-1].state == "failed"


def test_each_attempt_has_a_fresh_process(run: Run) -> None:
    run.bake_all(jobs=1, c1_0_0="error")
    folder = run.store.local_path("attempts")
    assert folder
    processes = {path.name.split("-")[1] for path in folder.glob("1_0_0-*")}
    assert len(processes) == 3


@pytest.mark.parametrize("act", ["crash once", "garbage once", "error once", "lie once"])
def test_a_passing_fault_is_got_over(run: Run, act: str) -> None:
    assert run.bake_all(c1_0_0=act).state == "done"
    assert run.attempts()["1_0_0"] == 2


def test_a_hang_is_noticed(run: Run) -> None:
    assert run.bake_all(c1_0_0="hang once", timeout=1).state == "done"
    retried = [event for event in run.events if event.kind == "retried"]
    assert [event.reason for event in retried] == ["The process gave no answer for 1 s."]


def test_a_cell_written_by_a_dying_process_is_done(run: Run) -> None:
    assert run.bake_all(c1_0_0="die after").state == "done"
    assert run.attempts()["1_0_0"] == 1


@pytest.mark.parametrize(
    ("start", "reason"),
    [
        ("crash", "ended with code 1; its last words: no GL library was found"),
        ("error", "no GPU"),
        ("garbage", "something else than JSON: 'what?'"),
    ],
)
def test_processes_that_do_not_come_up_blame_no_cell(run: Run, start: str, reason: str) -> None:
    status = run.bake_all(start=start)
    assert (status.state, status.done, status.failed) == ("failed", 0, 0)
    assert status.reason
    assert status.reason.startswith("Baking could not begin.")
    assert reason in status.reason
    assert run.events[-1].kind == "state"


def test_a_command_that_is_not_there(run: Run) -> None:
    with LocalDispatcher(run.store, 1, command=["/nonexistent"]) as dispatcher:
        dispatcher.submit(run.bake)
        status = dispatcher.wait(run.bake, timeout=30)
    assert status.state == "failed"
    assert "could not be started" in str(status.reason)


def test_pause_lets_running_cells_finish(run: Run) -> None:
    with run.dispatcher(jobs=1, **{"*": 0.3}) as dispatcher:
        dispatcher.submit(run.bake)
        until(lambda: dispatcher.status(run.bake).running == 1)
        dispatcher.pause(run.bake)
        until(lambda: dispatcher.status(run.bake).running == 0)
        paused = dispatcher.status(run.bake)
        assert (paused.state, paused.done) == ("paused", 1)
        time.sleep(0.5)
        assert dispatcher.status(run.bake) == paused
        dispatcher.resume(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).state == "done"
    assert sum(run.attempts().values()) == 4


def test_pausing_during_the_last_cell_still_ends(run: Run) -> None:
    with run.dispatcher(jobs=4, **{"*": 0.3}) as dispatcher:
        dispatcher.submit(run.bake)
        until(lambda: dispatcher.status(run.bake).running == 4)
        dispatcher.pause(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).state == "done"


def test_cancel_stops_at_once_and_blames_nobody(run: Run) -> None:
    with run.dispatcher(jobs=2, c0_0_0="hang once") as dispatcher:
        dispatcher.submit(run.bake)
        until(lambda: dispatcher.status(run.bake).done == 3 and run.attempts()["0_0_0"] == 1)
        dispatcher.cancel(run.bake)
        status = dispatcher.wait(run.bake, timeout=10)
        assert (status.state, status.done, status.failed) == ("cancelled", 3, 0)
        assert not [e for e in run.events if e.kind in ("retried", "failed")]
        dispatcher.submit(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).state == "done"


def test_retry_tries_failed_cells_anew(run: Run) -> None:
    with run.dispatcher(jobs=1, c1_0_0="crash") as dispatcher:
        dispatcher.submit(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).state == "failed"
        dispatcher.retry(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).failed == 1
    assert run.attempts()["1_0_0"] == 6


def test_first_cells_come_first(run: Run) -> None:
    with run.dispatcher(jobs=1, **{"*": 0.1}) as dispatcher:
        dispatcher.submit(run.bake)
        until(lambda: dispatcher.status(run.bake).running == 1)
        dispatcher.first(run.bake, ["3_0_0", "2_0_0", "9_9_9", "0_0_0"])
        dispatcher.wait(run.bake, timeout=30)
    started = [event.cell for event in run.events if event.kind == "started"]
    assert started == ["0_0_0", "3_0_0", "2_0_0", "1_0_0"]


def test_first_cells_come_before_those_of_other_bakes(tmp_path: Path) -> None:
    one, two = Run(tmp_path / "store"), Run(tmp_path / "store", cells=2)
    two.events = one.events
    with one.dispatcher(jobs=1, **{"*": 0.2}) as dispatcher:
        dispatcher.submit(one.bake)
        until(lambda: dispatcher.status(one.bake).running == 1)
        dispatcher.submit(two.bake)
        dispatcher.first(two.bake, ["1_0_0"])
        dispatcher.wait(one.bake, timeout=30)
        with pytest.raises(NotFoundError):
            dispatcher.first("0123456789abcdef", [])
    started = [(event.bake, event.cell) for event in one.events if event.kind == "started"]
    assert started[:3] == [(one.bake, "0_0_0"), (two.bake, "1_0_0"), (two.bake, "0_0_0")]


def test_bakes_share_the_processes_in_turn(tmp_path: Path) -> None:
    one, two = Run(tmp_path / "store"), Run(tmp_path / "store", cells=2)
    with one.dispatcher(jobs=2) as dispatcher:
        dispatcher.submit(one.bake)
        dispatcher.submit(two.bake)
        assert dispatcher.wait(one.bake, timeout=30).state == "done"
        assert dispatcher.wait(two.bake, timeout=30).state == "done"


def test_close_ends_hung_processes(run: Run) -> None:
    dispatcher = run.dispatcher(**{"*": "hang"})
    dispatcher.submit(run.bake)
    until(lambda: dispatcher.status(run.bake).running == 2)
    began = time.monotonic()
    dispatcher.close()
    assert time.monotonic() - began < 10
    names = {thread.name for thread in threading.enumerate()}
    assert not {name for name in names if name.startswith("farfield-slot")}


def test_a_faulty_listener_does_not_stop_the_baking(run: Run) -> None:
    def listen(event: Event) -> None:
        raise RuntimeError("no")

    with LocalDispatcher(run.store, 2, listen, command=FAKE) as dispatcher:
        dispatcher.submit(run.bake)
        assert dispatcher.wait(run.bake, timeout=30).state == "done"


def test_unknown_bakes_and_stores_that_cannot_be_shared(run: Run) -> None:
    with run.dispatcher() as dispatcher:
        with pytest.raises(NotFoundError):
            dispatcher.status("0123456789abcdef")
        with pytest.raises(NotFoundError):
            dispatcher.submit("0123456789abcdef")
    with pytest.raises(BadInputError):
        LocalDispatcher(Store.open("memory://"))
    with pytest.raises(BadInputError):
        LocalDispatcher(run.store, jobs=0)
