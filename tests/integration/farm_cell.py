"""Stands in for `farfield_worker cell` on a farm whose store may be S3: like `fake_executor`.

Each attempt leaves a file `<cell>-<process>-<time>` in the folder ATTEMPTS, ending in `.done` once
the cell is written. A cell holds 20 KB and their hash, so that a torn file shows. FAKE also knows
"fill" (takes memory without end) and "hidden" (fails on the worker that is first to come).
"""

import hashlib
import json
import os
import random
import sys
import time
from pathlib import Path

from farfield_core import layout
from farfield_core.cells import parse_cell_name
from farfield_core.errors import FarfieldError
from farfield_core.store import Store, StoreError
from farfield_worker.orphans import end_with_parent


def main() -> None:
    end_with_parent()
    store = Store.open(sys.argv[sys.argv.index("--store") + 1], patience=60)
    bake = sys.argv[sys.argv.index("--bake") + 1]
    behaviour = json.loads(os.environ.get("FAKE", "{}"))
    attempts = Path(os.environ["ATTEMPTS"])
    attempts.mkdir(parents=True, exist_ok=True)
    if os.environ.get("FAKE_START") == "crash":
        sys.exit("no GL library was found")
    say(ready=True, renderer="a stand-in")
    for line in sys.stdin:
        cell = line.strip()
        attempt = attempts / f"{cell}-{os.getpid()}-{time.monotonic_ns()}"
        attempt.touch()
        act = str(behaviour.get(cell, behaviour.get("*", 0)))
        if act == "crash":
            print("the driver gave up", file=sys.stderr, flush=True)
            os.kill(os.getpid(), 11)
        elif act == "hang":
            time.sleep(3600)
        elif act == "fill":
            fill()
        elif act == "error":
            say(cell=cell, ok=False, error="The cell is cursed.")
            continue
        elif act.startswith("burn "):
            burn(float(act.removeprefix("burn ")))
        else:
            time.sleep(float(act))
        try:
            store.put_new(layout.cell_key(bake, parse_cell_name(cell)), content(cell))
        except FarfieldError as error:
            say(cell=cell, ok=False, error=str(error), store=isinstance(error, StoreError))
        else:
            attempt.rename(f"{attempt}.done")
            say(cell=cell, ok=True, figures={"seconds": 0.1})


def content(cell: str) -> bytes:
    """A cell's file; the same for everyone who bakes it."""
    data = random.Random(cell).randbytes(10_000).hex()
    return json.dumps({"data": data, "hash": hashlib.sha256(data.encode()).hexdigest()}).encode()


def burn(seconds: float) -> None:
    """Use this much processor time."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        sum(range(1000))


def fill() -> None:
    """Take memory in steps, until somebody notices; never more than 4 GB."""
    taken = []
    for _ in range(400):
        taken.append(b"x" * 10_000_000)
        time.sleep(0.01)
    time.sleep(3600)


def say(**fields: object) -> None:
    print(json.dumps(fields), flush=True)


if __name__ == "__main__":
    main()
