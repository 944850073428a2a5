"""Stands in for `farfield_worker prepare`; what it does is the first word of the model file."""

import json
import resource
import sys
import time
from pathlib import Path


def main() -> int:
    argument = dict(zip(sys.argv[1::2], sys.argv[2::2], strict=True))
    source, out = Path(argument["--source"]), Path(argument["--out"])
    act = source.read_text(encoding="utf-8").split()[0]
    print("reading", flush=True)
    if act == "refuse":
        print(json.dumps({"ok": False, "error": f"{source.name} is no model."}))
        return 3
    if act == "crash":
        print("out of memory", file=sys.stderr)
        return 9
    if act == "spin":
        resource.setrlimit(resource.RLIMIT_CPU, (int(argument["--cpu-seconds"]), 60))
        while True:
            pass
    if act == "hang":
        time.sleep(3600)
    out.mkdir(parents=True)
    info = {
        "id": argument["--id"],
        "name": argument["--name"],
        "bounds": {"min": [0, 0, 0], "max": [1, 1, 1]},
        "origin": [0, 0, 0],
        "triangles": len(list(source.parent.iterdir())),
        "vertices": 3,
        "textures": [],
        "batches": [],
        "blocks": [],
    }
    (out / "positions.npy").write_bytes(b"numbers")
    (out / "scene.json").write_text(json.dumps(info), encoding="utf-8")
    print(json.dumps({"ok": True, "triangles": 1}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
