"""The Celery worker: tasks that bake cells and prepare scenes, run by the processes of its pool.

The parent process never opens the store, which does not survive a fork. What has to be written down
after a pool process died is therefore sent as a task of its own, to be run by a living one.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from celery import Celery, Task, signals
from farfield_core import layout, scenes
from farfield_core.cells import parse_cell_name
from farfield_core.control import read_control, write_failure
from farfield_core.dispatch.executor import COMMAND
from farfield_core.dispatch.jobs import ATTEMPTS
from farfield_core.dispatch.prepare import prepare_scene
from farfield_core.dispatch.queues import (
    BAKE_CELL,
    CELL_FAILED,
    PREPARE_SCENE,
    RETRIES,
    SMALL,
    celery_app,
)
from farfield_core.errors import SceneRefusedError
from farfield_core.store import Store

from farfield_worker.farm.bakers import Baker


def create_worker(broker: str, store_url: str, command: Sequence[str] = COMMAND) -> Celery:
    """Make the application that `farfield worker` runs; `command` starts what bakes a cell."""
    app = celery_app(broker)

    # Both are made in a pool process, when it is first asked for a cell.
    @lru_cache(maxsize=1)
    def store() -> Store:
        return Store.open(store_url)

    @lru_cache(maxsize=1)
    def baker() -> Baker:
        return Baker(store_url, command)

    @app.task(name=BAKE_CELL, autoretry_for=(Exception,), **RETRIES)
    def bake_cell(bake: str, cell: str) -> None:
        control = read_control(store(), bake)
        if control is not None and control.wanted in ("paused", "cancelled"):
            return
        key = layout.cell_key(bake, parse_cell_name(cell))
        if store().exists(key):
            return
        baker().bake_cell(bake, cell)
        if not store().exists(key):
            raise RuntimeError(f"Cell {cell} was not found in the store after it was baked.")

    @app.task(name=CELL_FAILED, **RETRIES)
    def cell_failed(bake: str, cell: str, reason: str) -> None:
        write_failure(store(), bake, cell, reason)

    @app.task(name=PREPARE_SCENE, bind=True, **RETRIES)
    def prepare(task: Task, scene: str) -> None:
        try:
            prepare_scene(store(), scene)
        except SceneRefusedError:
            return  # the store remembers why
        except Exception as error:
            if task.request.retries >= task.max_retries:
                scenes.refuse(store(), scene, f"The scene could not be prepared: {error}")
                raise
            raise task.retry(exc=error) from None

    @signals.task_failure.connect(sender=bake_cell, weak=False)
    def give_up(args: list[str] | None = None, exception: object = None, **_: Any) -> None:
        """Called in whichever process saw the last attempt end."""
        bake, cell = args or ("", "")
        reason = f"{exception} (tried {ATTEMPTS} times)"
        app.send_task(CELL_FAILED, [bake, cell, reason], queue=SMALL)

    return app


def run_worker(app: Celery, jobs: int | None) -> None:
    """Work until told to stop; cells under way are finished first."""
    # Many small software renderers beat one that uses all cores.
    os.environ.setdefault("LP_NUM_THREADS", "0")
    app.worker_main(
        [
            "worker",
            "--pool=prefork",
            f"--concurrency={jobs or os.cpu_count() or 1}",
            "--loglevel=INFO",
            "--without-gossip",
            "--without-mingle",
        ]
    )


def answering_workers(broker: str, hostname: str) -> int:
    """How many workers on a host answer within some seconds."""
    app = celery_app(broker)
    return len(app.control.ping(destination=[f"celery@{hostname}"], timeout=5.0))
