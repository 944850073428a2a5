"""The farm's queues: what a server sends and a worker takes, over Celery and Redis.

Settings that are not Celery's defaults, and why:

- acks_late: a scene whose worker dies is prepared by another. A cell whose process dies is not
  handed out again by Celery, which would do so for ever: the feeder counts attempts;
- no prefetching: a worker holds no cell that an idle one could bake;
- no result backend: what is done is what the store lists;
- a visibility timeout of three times the longest task, because a task that takes longer than it is
  handed out again while it runs;
- unacked_restore_interval and _throttle: the default sweep for lost tasks takes 100 s.
"""

from __future__ import annotations

from typing import Any, Literal

from celery import Celery

from farfield_core.dispatch.jobs import ATTEMPTS

BAKE_CELL = "farfield.bake_cell"
CELL_TRIED = "farfield.cell_tried"
PREPARE_SCENE = "farfield.prepare_scene"

Device = Literal["cpu", "gpu"]

#: cells that a walker waits for
FIRST = "farfield.first"
#: all other cells
CELLS = "farfield.cells"
#: the same for workers that draw with a GPU
GPU_FIRST, GPU_CELLS = "farfield.gpu.first", "farfield.gpu.cells"
#: scenes to prepare, and short messages
SMALL = "farfield.small"

#: seconds after which a task counts as hung
LONGEST = 900


def cell_queues(device: Device) -> tuple[str, str]:
    """Queues of cells: those a walker waits for, and all others."""
    return (GPU_FIRST, GPU_CELLS) if device == "gpu" else (FIRST, CELLS)


def served_queues(device: Device) -> tuple[str, ...]:
    """What a worker takes from, in this order."""
    first, others = cell_queues(device)
    return (first, SMALL, others)


def celery_app(broker: str, device: Device = "cpu", longest: float = LONGEST) -> Celery:
    """Make the Celery application that servers send with and workers run."""
    app = Celery("farfield", broker=broker, set_as_current=False)
    transport: dict[str, Any] = {
        "visibility_timeout": 3 * longest,
        "unacked_restore_interval": 5,
        "unacked_restore_throttle": 1,
        "queue_order_strategy": "priority",
        "socket_connect_timeout": 5,
        "socket_keepalive": True,
    }
    app.conf.update(
        accept_content=["json"],
        broker_connection_max_retries=None,
        broker_connection_retry_on_startup=True,
        broker_transport_options=transport,
        task_acks_late=True,
        task_create_missing_queues=False,
        task_default_queue=SMALL,
        task_ignore_result=True,
        task_queues={name: {"routing_key": name} for name in served_queues(device)},
        task_time_limit=longest + 30,
        # A lost connection does not stop a cell; the file it writes is what counts.
        worker_cancel_long_running_tasks_on_connection_loss=False,
        worker_disable_prefetch=True,
        worker_hijack_root_logger=False,
        worker_prefetch_multiplier=1,
    )
    return app


#: options of every task: tries in all, and at once
RETRIES: dict[str, Any] = {"max_retries": ATTEMPTS - 1, "default_retry_delay": 0}
