"""`farfield serve` as a process of its own, as users run it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx2


class Live:
    """A running server.

    Attributes:
        url: its root, without a slash at the end.
        pid: of the server's process.
    """

    def __init__(self, url: str, process: subprocess.Popen[str]) -> None:
        self.url, self.pid = url, process.pid
        self._process = process

    @property
    def api(self) -> str:
        """Root of the API."""
        return f"{self.url}/api/v1"

    def memory(self, peak: bool = False) -> int:
        """Resident bytes of the server alone, without what it started; `peak`: the most so far."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        found = re.search(r"VmHWM:\s+(\d+)" if peak else r"VmRSS:\s+(\d+)", status)
        assert found
        return int(found[1]) * 1024

    def client(self, **how: Any) -> httpx2.Client:
        """A client of the API."""
        return httpx2.Client(base_url=f"{self.api}/", timeout=60, **how)


@contextmanager
def serving(store: Path, *arguments: str, **variables: str) -> Iterator[Live]:
    """Serve a store on a free port of loopback."""
    command = [sys.executable, "-m", "farfield", "serve", "--store", str(store), "--port", "0"]
    log = store.with_name(f"{store.name}-{time.monotonic_ns()}.log")
    with log.open("w") as out:
        process = subprocess.Popen(
            [*command, *arguments],
            stdout=subprocess.DEVNULL,
            stderr=out,
            text=True,
            env=os.environ | variables,
        )
        try:
            end = time.monotonic() + 60
            while not (told := re.search(r"at (http://\S+)", log.read_text())):
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < end, log.read_text()
                time.sleep(0.05)
            live = Live(told[1], process)
            while True:
                with suppress(httpx2.TransportError):
                    if httpx2.get(f"{live.api}/ready").status_code == 200:
                        break
                assert time.monotonic() < end, log.read_text()
                time.sleep(0.05)
            yield live
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=30)
