"""What serving walks and taking uploads costs: cells over 64 kept-alive connections, and 5 GB.

    python -m bench.service [--json] [--keep]

A store with 60 cells of 2 MB of JSON, as the paper's layers have in a dense scene, which brotli
makes 270 KB of; half of the requests go to a few of them. The client is a process of its own on the
same machine, so both share its cores. `cpu_ms` is the server's processor time for a request, which
hardly depends on what else runs. `web` is the same through the web server of Compose and the chart
(deploy/helm/farfield/files/nginx.conf), where nginx is installed; they take turns.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from farfield_core import layout
from farfield_core.store import Store

from bench.stand import report
from tests.integration.live import serving
from tests.integration.test_api_uploads import upload_sparse
from tests.integration.web import NGINX, web_server

CONNECTIONS = 64
CELLS = 60
SECONDS = 8.0
TURNS = 3
UPLOAD = 5 * 10**9
BAKE = "0123456789abcdef"


def figures() -> dict[str, Any]:
    """Of the API alone, and of it behind the web server: see `turn`; memory before and after."""
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        store = Store.open(str(Path(folder) / "store"))
        fill(store)
        with ExitStack() as servers:
            live = servers.enter_context(serving(Path(folder) / "store"))
            asked = {"api": live.url}
            if NGINX:
                asked["web"] = servers.enter_context(web_server(live.url, Path(folder) / "web"))
            for url in asked.values():  # every form is made and kept
                asyncio.run(load(url, 5.0))
            before = live.memory()
            turns: dict[str, list[Turn]] = {name: [] for name in asked}
            for _ in range(TURNS):
                for name, url in asked.items():
                    cpu = cpu_seconds(live.pid)
                    seconds, faults, received = asyncio.run(load(url, SECONDS))
                    cpu = cpu_seconds(live.pid) - cpu
                    turns[name].append(Turn(seconds, faults, received, cpu))
            after = live.memory()
        before_upload, peak_upload = upload_sparse(Path(folder) / "uploaded", UPLOAD)
    return {
        "connections": CONNECTIONS,
        **{name: describe(found) for name, found in turns.items()},
        "memory_before_mb": before / 1e6,
        "memory_after_mb": after / 1e6,
        "upload_gb": UPLOAD / 1e9,
        "upload_memory_before_mb": before_upload / 1e6,
        "upload_memory_peak_mb": peak_upload / 1e6,
    }


class Turn(NamedTuple):
    """One turn's answers: seconds of each, faults, bytes, processor time of the API."""

    seconds: list[float]
    faults: int
    received: int
    cpu: float


def describe(turns: list[Turn]) -> dict[str, Any]:
    """Figures of all turns together; the slowest hundredth also of each turn."""
    each = [np.array(turn.seconds) * 1000 for turn in turns]
    times = np.concatenate(each)
    return {
        "requests": len(times),
        "errors": sum(turn.faults for turn in turns),
        "requests_per_second": len(times) / SECONDS / TURNS,
        "megabytes_per_second": sum(turn.received for turn in turns) / SECONDS / TURNS / 1e6,
        "p50_ms": float(np.percentile(times, 50)),
        "p99_ms": float(np.percentile(times, 99)),
        "p99_ms_of_each_turn": [float(np.percentile(turn, 99)) for turn in each],
        "cpu_ms": 1000 * sum(turn.cpu for turn in turns) / len(times),
    }


def fill(store: Store) -> None:
    """A bake whose cells have as many numbers as real ones."""
    random = np.random.default_rng(1)
    store.put(layout.walk_key(BAKE), b"{}")
    # each number is one of 256: as many bits as a number of a real cell has when it is packed
    table = np.round(random.normal(size=256), 4)
    numbers = json.dumps(table[random.integers(256, size=260_000)].tolist(), separators=(",", ":"))
    for i in range(CELLS):
        data = f'{{"cell":[{i},0,0],"corners":{numbers}}}'
        store.put(layout.cell_key(BAKE, (i, 0, 0)), data.encode())


async def load(url: str, seconds: float) -> tuple[list[float], int, int]:
    """Ask over all connections for a while: seconds of each answer, faults, bytes received."""
    times: list[float] = []
    faults = received = 0
    port = int(url.rsplit(":", 1)[1])
    end = time.monotonic() + seconds

    async def one(number: int) -> None:
        nonlocal faults, received
        random = np.random.default_rng(number)
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1 << 22)
        while time.monotonic() < end:
            cell = int(random.integers(20 if random.random() < 0.5 else CELLS))
            path = f"/api/v1/walks/{BAKE}/cells/{cell}_0_0.json"
            begun = time.perf_counter()
            writer.write(
                f"GET {path} HTTP/1.1\r\nHost: bench\r\nAccept-Encoding: br\r\n\r\n".encode()
            )
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
            length = re.search(r"content-length: (\d+)", head)
            assert length
            body = await reader.readexactly(int(length[1]))
            times.append(time.perf_counter() - begun)
            faults += not head.startswith("http/1.1 200")
            received += len(body)
        writer.close()

    await asyncio.gather(*(one(number) for number in range(CONNECTIONS)))
    return times, faults, received


def cpu_seconds(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    report("service", figures())
