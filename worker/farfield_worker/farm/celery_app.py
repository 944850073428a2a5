"""The Celery worker: tasks that bake cells and prepare scenes, run by the processes of its pool.

The parent process never opens the store, which does not survive a fork. What has to be written down
after a pool process died is therefore sent as a task of its own, to be run by a living one.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import sys
from collections.abc import Sequence
from typing import Any

from celery import Celery, Task, signals
from farfield_core import scenes
from farfield_core.dispatch.board import LOST, Board
from farfield_core.dispatch.celery_prepare import PREPARING
from farfield_core.dispatch.executor import COMMAND
from farfield_core.dispatch.prepare import PrepareLimits, prepare_scene
from farfield_core.dispatch.queues import (
    BAKE_CELL,
    CELL_TRIED,
    PREPARE_SCENE,
    RETRIES,
    SMALL,
    Device,
    celery_app,
    cell_queues,
    served_queues,
)
from farfield_core.dispatch.slots import Slot
from farfield_core.errors import FarfieldError, SceneRefusedError
from farfield_core.store import Store

from farfield_worker.farm.bakers import START_TIMEOUT, Baker, Limits
from farfield_worker.farm.desk import Desk
from farfield_worker.farm.heartbeat import Heartbeat
from farfield_worker.orphans import end_with_parent

log = logging.getLogger(__name__)

#: seconds that a store may be gone before a cell is handed back
_PATIENCE = 60.0


def create_worker(
    broker: str,
    store_url: str,
    command: Sequence[str] = COMMAND,
    device: Device = "cpu",
    limits: Limits | None = None,
    lost: int = LOST,
    prepare_limits: PrepareLimits | None = None,
) -> Celery:
    """Make the application that `farfield worker` runs.

    `command` starts what bakes a cell; `lost` is the number of seconds without a sign of life after
    which a process counts as lost.
    """
    limits = limits or Limits()
    app = celery_app(broker, device, START_TIMEOUT + limits.seconds + 60)
    name = f"{socket.gethostname()}-{os.getpid()}"
    desks: list[Desk] = []

    def desk() -> Desk:
        return desks[0]

    @signals.worker_process_init.connect(weak=False)
    def sit_down(**_: Any) -> None:
        """Make what a pool process works with, in that process."""
        end_with_parent()
        board = Board(broker, lost)
        baker = Baker(store_url, command, limits)
        slot = Slot(name, os.getpid(), socket.gethostname(), device)
        heartbeat = Heartbeat(board, slot, baker.drop, lambda: baker.megabytes)
        store = Store.open(store_url, patience=_PATIENCE)
        desks[:] = [Desk(store, baker, board, heartbeat)]

    @signals.worker_process_shutdown.connect(weak=False)
    def stand_up(**_: Any) -> None:
        if desks:
            desk().baker.close()
            desk().heartbeat.close()

    @app.task(name=BAKE_CELL, bind=True)
    def bake_cell(task: Task, bake: str, cell: str, avoid: Sequence[str] = ()) -> None:
        def hand_over() -> None:
            queue = task.request.delivery_info.get("routing_key") or cell_queues(device)[1]
            with contextlib.suppress(Exception):  # the feeder finds a cell that gets lost
                app.send_task(BAKE_CELL, [bake, cell, list(avoid)], queue=queue, retry=False)

        desk().bake(bake, cell, avoid, hand_over)

    @app.task(name=CELL_TRIED)
    def cell_tried(bake: str, cell: str, reason: str) -> None:
        with contextlib.suppress(FarfieldError):
            desk().tried(bake, cell, reason)

    @app.task(name=PREPARE_SCENE, bind=True, **RETRIES)
    def prepare(task: Task, scene: str) -> None:
        if not desk().heartbeat.begin(PREPARING, scene):
            return
        try:
            prepare_scene(desk().store, scene, limits=prepare_limits)
        except SceneRefusedError:
            return  # the store remembers why
        except Exception as error:
            if task.request.retries >= task.max_retries:
                scenes.refuse(desk().store, scene, f"The scene could not be prepared: {error}")
                raise
            raise task.retry(exc=error) from None
        finally:
            desk().heartbeat.end("")

    @signals.task_failure.connect(sender=bake_cell, weak=False)
    def blame(args: Sequence[str] | None = None, exception: object = None, **_: Any) -> None:
        """Called in the parent when a pool process died with a cell."""
        bake, cell, *_others = args or ("", "")
        app.send_task(CELL_TRIED, [bake, cell, str(exception)], queue=SMALL, retry=False)

    return app


def run_worker(app: Celery, jobs: int | None, device: Device = "cpu") -> None:
    """Work until told to stop; cells under way are finished first."""
    # Many small software renderers beat one that uses all cores.
    os.environ.setdefault("LP_NUM_THREADS", "0")
    # Celery's own command line would take a third of a second to import.
    worker = app.Worker(
        pool_cls="prefork",
        concurrency=jobs or os.cpu_count() or 1,
        queues=served_queues(device),
        hostname=f"farfield-{os.getpid()}@{socket.gethostname()}",
        loglevel="INFO",
        without_gossip=True,
        without_mingle=True,
    )
    worker.start()
    sys.exit(worker.exitcode)


def answering_workers(broker: str, hostname: str) -> int:
    """How many workers on a host gave a sign of life lately."""
    board = Board(broker)
    try:
        return len({slot.worker for slot in board.slots() if slot.host == hostname})
    finally:
        board.close()
