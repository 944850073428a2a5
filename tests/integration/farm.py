"""A farm of real workers around a real Redis, for tests that take parts of it away."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from farfield_core import layout
from farfield_core.bake import done_cells
from farfield_core.dispatch import Event
from farfield_core.dispatch.celery import CeleryDispatcher
from farfield_core.store import Store

from tests.integration.serving import until

WORKER = Path(__file__).with_name("farm_worker.py")


class Farm:
    """One broker, one store, and the workers that a test starts.

    Args:
        broker: redis://...
        store: a folder or s3://...
        folder: for logs and for what stand-ins leave behind.
        environment: variables of workers.
    """

    def __init__(
        self, broker: str, store: str, folder: Path, environment: dict[str, str] | None = None
    ) -> None:
        self.broker = broker
        self.url = store
        self.store = Store.open(store)
        self._folder = folder
        self._environment = environment or {}
        self._stack = ExitStack()
        self._logs: dict[int, Path] = {}

    def __enter__(self) -> Farm:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def worker(
        self,
        jobs: int = 2,
        env: dict[str, str] | None = None,
        *,
        wait: bool = True,
        **fake: Any,
    ) -> subprocess.Popen[bytes]:
        """Start a worker; `fake` maps c<i>_<j>_<k>, and `*`, to what happens there (farm_cell)."""
        return self._stack.enter_context(self._worker(jobs, env or {}, wait, fake))

    def workers(self, count: int, env: dict[str, str] | None = None, **fake: Any) -> None:
        """Start workers of one process each, side by side, and wait until all are ready."""
        started = [self.worker(1, env, wait=False, **fake) for _ in range(count)]
        for process in started:
            self.ready(process)

    def ready(self, worker: subprocess.Popen[bytes]) -> None:
        """Wait until a worker takes cells."""
        log = self._logs[worker.pid]
        until(lambda: b"ready." in log.read_bytes() or worker.poll() is not None, "a worker")
        assert worker.poll() is None, log.read_text()

    @contextmanager
    def _worker(
        self, jobs: int, env: dict[str, str], wait: bool, fake: dict[str, Any]
    ) -> Iterator[subprocess.Popen[bytes]]:
        behaviour = json.dumps({name.removeprefix("c"): act for name, act in fake.items()})
        log = self._folder / f"worker-{time.monotonic_ns()}.log"
        with log.open("wb") as out:
            process = subprocess.Popen(
                [sys.executable, WORKER, self.broker, self.url, str(jobs)],
                env={
                    **os.environ,
                    "FAKE": behaviour,
                    "ATTEMPTS": str(self._folder / "attempts"),
                    **self._environment,
                    **env,
                },
                cwd=WORKER.parents[2],
                stdout=out,
                stderr=out,
                start_new_session=True,
            )
        try:
            self._logs[process.pid] = log
            if wait:
                self.ready(process)
            yield process
        finally:
            kill(process)

    def feeder(self, **options: Any) -> tuple[CeleryDispatcher, list[Event]]:
        """Start a feeder; it is closed with the farm."""
        events: list[Event] = []
        defaults = {"interval": 0.1, "patience": 1.5}
        dispatcher = CeleryDispatcher(
            self.store, self.broker, events.append, **{**defaults, **options}
        )
        self._stack.callback(dispatcher.close)
        return dispatcher, events

    def attempts(self) -> Counter[str]:
        """How often each cell was begun."""
        return self._counted("*")

    def finished(self) -> Counter[str]:
        """How often each cell was baked to its end."""
        return self._counted("*.done")

    def _counted(self, pattern: str) -> Counter[str]:
        found = (self._folder / "attempts").glob(pattern)
        return Counter(path.name.split("-")[0] for path in found)

    def assert_intact(self, bake: str, cells: int) -> None:
        """All cells of a row are there, and none is torn."""
        assert done_cells(self.store, bake) == {(i, 0, 0) for i in range(cells)}
        for i in range(cells):
            cell = json.loads(self.store.get(layout.cell_key(bake, (i, 0, 0))))
            assert cell["hash"] == hashlib.sha256(cell["data"].encode()).hexdigest()


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a worker with all its processes, as a machine that loses its power."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def children(process: subprocess.Popen[bytes]) -> list[int]:
    """Processes of a worker's pool."""
    text = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii")
    return [int(word) for word in text.split()]
