"""A bake's bookkeeping against a slow obvious one, and its size for a million cells."""

from __future__ import annotations

import tracemalloc

import numpy as np
from farfield_core.cells import cell_name
from farfield_core.control import Attempt
from farfield_core.dispatch.blame import Blame
from farfield_core.dispatch.jobs import Job
from farfield_core.dispatch.rows import CellRows
from farfield_core.dispatch.slots import Slot
from farfield_core.dispatch.wanted import TARGET, wanted_workers
from farfield_core.store import Store
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.walks import row_of_cells

INDEX = st.tuples(*[st.integers(-40, 40)] * 3)


@given(st.lists(INDEX, min_size=1, max_size=60, unique=True), st.lists(INDEX, max_size=20))
def test_cells_are_found_by_name(cells: list[tuple[int, int, int]], asked: list[object]) -> None:
    rows = CellRows(np.array(cells, np.int32))
    names = [cell_name(cell) for cell in cells]
    assert rows.find(names).tolist() == list(range(len(cells)))
    assert [rows.name(row) for row in range(len(cells))] == names
    wanted = [cells.index(a) if a in cells else -1 for a in asked]  # type: ignore[arg-type]
    assert rows.find(cell_name(a) for a in asked).tolist() == wanted  # type: ignore[arg-type]
    assert rows.find(["nonsense", "1_2", "999999999_0_0"]).tolist() == [-1, -1, -1]


def test_a_million_cells_take_little_memory() -> None:
    side = 1000
    i, k = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    index = np.stack([i.ravel(), np.zeros(side * side, int), k.ravel()], axis=1).astype(np.int32)
    tracemalloc.start()
    rows = CellRows(index)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 20e6
    assert rows.find(["999_0_999"]).tolist() == [side * side - 1]


class Plain:
    """A bake's cells in plain lists: what Job has to agree with."""

    def __init__(self, cells: int) -> None:
        self.waiting = [f"{i}_0_0" for i in range(cells)]
        self.running: list[str] = []
        self.done: set[str] = set()
        self.failed: set[str] = set()


@settings(max_examples=60)
@given(st.lists(st.tuples(st.sampled_from("tdpsff+"), st.integers(0, 5)), max_size=60))
def test_a_job_agrees_with_plain_lists(steps: list[tuple[str, int]]) -> None:
    store = Store.open("memory://")
    job = Job(store, row_of_cells(store, 6).id, hold=True)
    plain = Plain(6)
    for what, number in steps:
        cell = f"{number}_0_0"
        running = cell in plain.running
        if what == "t":
            taken = job.take()
            assert taken == (plain.waiting.pop(0) if plain.waiting else None)
            if taken:
                plain.running.append(taken)
        elif what == "d" and running:
            job.done(cell)
            plain.running.remove(cell)
            plain.done.add(cell)
        elif what == "p" and running:
            job.put_back(cell)
            plain.running.remove(cell)
            plain.waiting.insert(0, cell)
        elif what == "s" and running:
            job.fail(cell, "It failed.")
            plain.running.remove(cell)
            plain.failed.add(cell)
        elif what == "f":
            job.first([cell])
            if cell in plain.waiting:
                plain.waiting.remove(cell)
                plain.waiting.insert(0, cell)
        elif what == "+":
            known = cell in plain.done
            assert job.found([cell, cell]) == ([] if known else [cell])
            for group in (plain.waiting, plain.running):
                if cell in group:
                    group.remove(cell)
            plain.failed.discard(cell)
            plain.done.add(cell)
        status = job.status()
        assert job.running == set(plain.running)
        assert set(status.reasons) == plain.failed
        assert (status.done, job.left) == (
            len(plain.done),
            len(plain.waiting) + len(plain.running),
        )


def test_a_bake_ends_only_when_the_store_lists_its_cells() -> None:
    store = Store.open("memory://")
    job = Job(store, row_of_cells(store, 3).id, hold=True)
    while (cell := job.take()) is not None:
        job.found([cell])
    assert (job.left, job.state) == (0, "running")
    seen = job.listed(["0_0_0", "2_0_0", "7_7_7"])
    assert job.confirm(seen, job.snapshot()).tolist() == []
    job.let_end()
    assert (job.left, job.state) == (1, "running")
    assert job.take() == "1_0_0"
    job.found(["1_0_0"])
    assert job.confirm(job.listed(f"{i}_0_0" for i in range(3)), job.snapshot()).size == 0
    job.let_end()
    assert job.state == "done"


def test_what_is_done_while_the_store_lists_is_not_taken_back() -> None:
    store = Store.open("memory://")
    job = Job(store, row_of_cells(store, 2).id, hold=True)
    before = job.snapshot()
    seen = job.listed([])
    job.found(["1_0_0"])  # after the list began
    job.confirm(seen, before)
    assert job.left == 1


def attempt(worker: str) -> Attempt:
    return Attempt(worker=worker, reason="It broke.")


def test_a_cell_is_given_up_after_three_workers() -> None:
    blame, live = Blame(), {"a", "b", "c", "d"}
    for n, worker in enumerate("aab"):
        assert blame.verdict("bake", "0_0_0", live) is None
        assert blame.add("bake", "0_0_0", str(n), attempt(worker)) is True
        assert blame.add("bake", "0_0_0", str(n), attempt(worker)) is False
    assert blame.verdict("bake", "0_0_0", live) is None
    assert blame.verdict("bake", "0_0_0", {"a", "b"}) == "It broke. (tried 3 times by 2 workers)"
    blame.add("bake", "0_0_0", "3", attempt("c"))
    assert blame.verdict("bake", "0_0_0", live) == "It broke. (tried 4 times by 3 workers)"
    blame.forget("bake")
    assert blame.verdict("bake", "0_0_0", live) is None


def test_a_worker_is_faulty_when_others_bake_what_it_fails() -> None:
    blame = Blame()
    for n in range(3):
        blame.add("bake", f"{n}_0_0", "x", attempt("bad"))
        assert blame.baked("bake", f"{n}_0_0", "bad") == set()
        assert blame.baked("bake", f"{n}_0_0", "good") == ({"bad"} if n == 2 else set())


def test_wanted_workers() -> None:
    two = [Slot("w", 1, rate=0.5), Slot("w", 2, rate=0.5)]  # 2 s a cell
    assert wanted_workers(0, two) == 0
    assert wanted_workers(1, []) == 1
    assert wanted_workers(1, two) == 1
    assert wanted_workers(int(TARGET), two) == 1
    assert wanted_workers(int(100 * TARGET), two) == 100
