"""Stands in for `farfield_worker cell` in tests of dispatchers; behaviour by environment.

FAKE maps cell names to what happens there: "crash", "hang", "garbage", "error", "lie" (says it is
done, writes nothing), "die after" (writes the cell, then dies), "other" (answers for another cell),
"flood", or a number of seconds to take. "*" is for all other cells. A behaviour ending in " once"
shows only on a cell's first attempt. FAKE_START may be "crash", "garbage" or "error".
"""

import json
import os
import sys
import time
from pathlib import Path


def main() -> None:
    store = Path(sys.argv[sys.argv.index("--store") + 1])
    bake = sys.argv[sys.argv.index("--bake") + 1]
    behaviour = json.loads(os.environ.get("FAKE", "{}"))
    start = os.environ.get("FAKE_START")
    if start == "crash":
        sys.exit("no GL library was found")
    say("what?" if start == "garbage" else json.dumps({"ready": start is None, "error": "no GPU"}))
    for line in sys.stdin:
        cell = line.strip()
        attempts = store / "attempts"
        attempts.mkdir(exist_ok=True)
        first = not list(attempts.glob(f"{cell}-*"))
        (attempts / f"{cell}-{os.getpid()}-{time.monotonic_ns()}").touch()
        act = str(behaviour.get(cell, behaviour.get("*", 0)))
        if act.endswith(" once"):
            act = act.removesuffix(" once") if first else "0"
        perform(act, cell, store / "bakes" / bake / "cells" / f"{cell}.json")


def perform(act: str, cell: str, path: Path) -> None:
    if act == "crash":
        print("the driver gave up", file=sys.stderr, flush=True)
        os.kill(os.getpid(), 11)
    elif act == "hang":
        time.sleep(3600)
    elif act == "garbage":
        say("%$!")
    elif act == "flood":
        while True:
            say("x" * 1000)
    elif act == "error":
        say(json.dumps({"cell": cell, "ok": False, "error": "The cell is cursed."}))
    elif act == "other":
        say(json.dumps({"cell": "9_9_9", "ok": True, "figures": {}}))
    elif act == "lie":
        say(json.dumps({"cell": cell, "ok": True, "figures": {}}))
    else:
        if act != "die after":
            time.sleep(float(act))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"figures": {"seconds": 0.5, "quads": 10}}))
        if act == "die after":
            os._exit(3)
        say(json.dumps({"cell": cell, "ok": True, "figures": {"seconds": 0.5, "quads": 10}}))


def say(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    main()
