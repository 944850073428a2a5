"""Baking from the command line: figures, resuming, interrupting; a fake executor does the work."""

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path

import pytest
from farfield.baking import Outcome, bake_all
from farfield_core.bake import done_cells
from farfield_core.store import Store
from farfield_core.walk import Walk

from tests.unit.walks import row_of_cells

FAKE = (sys.executable, str(Path(__file__).with_name("fake_executor.py")))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "store")


@pytest.fixture
def walk(store: Store) -> Walk:
    return row_of_cells(store, 4)


def bake(store: Store, walk: Walk) -> Outcome:
    return bake_all(store, walk, 2, FAKE)


def test_figures_are_means_over_all_cells(
    store: Store, walk: Walk, capsys: pytest.CaptureFixture[str]
) -> None:
    earlier = {"figures": {"seconds": 2.5, "quads": 50, "texels": 8, "atlas_bytes": 400}}
    store.put_new(f"bakes/{walk.id}/cells/2_0_0.json", json.dumps(earlier).encode())
    outcome = bake(store, walk)
    assert outcome.status.state == "done"
    assert outcome.figures == {
        "bake": walk.id,
        "cells": 4,
        "failed": 0,
        "near_field": walk.near_field,
        "seconds_per_cell": 1.0,
        "quads": 20.0,
        "texels": 2.0,
        "near_triangles": 0.0,
        "atlas_bytes": 100.0,
    }
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "4/4 cells" in captured.err


def test_nothing_to_do(store: Store, walk: Walk) -> None:
    first = bake(store, walk)
    assert bake_all(store, walk, 2, ["/nonexistent"]).figures == first.figures


def test_failed_cells_are_told(
    store: Store, walk: Walk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FAKE", json.dumps({"1_0_0": "error"}))
    outcome = bake(store, walk)
    assert (outcome.figures["cells"], outcome.figures["failed"]) == (3, 1)
    assert outcome.complaint() == (
        "1 of 4 cells could not be baked, the first of them 1_0_0: "
        "The cell is cursed. (tried 3 times)"
    )
    assert "Cell 1_0_0 retried: The cell is cursed." in capsys.readouterr().err


def test_a_bake_that_cannot_begin(
    store: Store, walk: Walk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAKE_START", "crash")
    assert "no GL library was found" in bake(store, walk).complaint()


def test_an_interrupted_bake_goes_on_where_it_stopped(
    store: Store, walk: Walk, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FAKE", json.dumps({"2_0_0": "hang", "3_0_0": "hang"}))

    def interrupt() -> None:
        while len(done_cells(store, walk.id)) < 2:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        bake(store, walk)
    assert (
        "2 of 4 cells are baked; run the same command again to bake the rest."
        in capsys.readouterr().err
    )
    monkeypatch.setenv("FAKE", "{}")
    before = {n: store.get(f"bakes/{walk.id}/cells/{n}_0_0.json") for n in (0, 1)}
    assert bake(store, walk).figures["cells"] == 4
    for n, data in before.items():
        assert store.get(f"bakes/{walk.id}/cells/{n}_0_0.json") == data
    attempts = store.local_path("attempts")
    assert attempts
    assert [len(list(attempts.glob(f"{n}_0_0-*"))) for n in (0, 1)] == [1, 1]
