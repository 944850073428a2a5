"""What serving walks costs: cells straight from the API over 64 kept-alive connections.

    python -m bench.service [--json] [--keep]

A store with 60 cells of 2 MB of JSON, half of the requests on a few of them; the client is a
process of its own on the same machine, so both share its cores. `cpu_ms` is the server's processor
time for a request, which hardly depends on what else runs.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core import layout
from farfield_core.store import Store

from bench.stand import report
from tests.integration.live import Live, serving

CONNECTIONS = 64
CELLS = 60
SECONDS = 15.0
BAKE = "0123456789abcdef"


def figures() -> dict[str, Any]:
    """Requests a second, seconds of the slowest hundredth, memory before and after."""
    with tempfile.TemporaryDirectory(prefix="farfield-bench-") as folder:
        store = Store.open(str(Path(folder) / "store"))
        fill(store)
        with serving(Path(folder) / "store") as live:
            asyncio.run(load(live, 5.0))  # every form is made and kept
            before, cpu = live.memory(), cpu_seconds(live.pid)
            seconds, faults, received = asyncio.run(load(live, SECONDS))
            after, cpu = live.memory(), cpu_seconds(live.pid) - cpu
    times = np.sort(np.array(seconds)) * 1000
    return {
        "connections": CONNECTIONS,
        "requests": len(times),
        "errors": faults,
        "requests_per_second": len(times) / SECONDS,
        "megabytes_per_second": received / SECONDS / 1e6,
        "p50_ms": float(np.percentile(times, 50)),
        "p99_ms": float(np.percentile(times, 99)),
        "cpu_ms": 1000 * cpu / max(1, len(times)),
        "memory_before_mb": before / 1e6,
        "memory_after_mb": after / 1e6,
    }


def fill(store: Store) -> None:
    """A bake whose cells have as many numbers as real ones."""
    random = np.random.default_rng(1)
    store.put(layout.walk_key(BAKE), b"{}")
    numbers = np.round(random.normal(size=260_000), 4).tolist()
    for i in range(CELLS):
        data = json.dumps({"cell": [i, 0, 0], "corners": numbers}, separators=(",", ":"))
        store.put(layout.cell_key(BAKE, (i, 0, 0)), data.encode())


async def load(live: Live, seconds: float) -> tuple[list[float], int, int]:
    """Ask over all connections for a while: seconds of each answer, faults, bytes received."""
    times: list[float] = []
    faults = received = 0
    port = int(live.url.rsplit(":", 1)[1])
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
