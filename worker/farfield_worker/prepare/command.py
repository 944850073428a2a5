"""`python -m farfield_worker prepare`: prepares one model in a process of its own."""

from __future__ import annotations

import argparse
import json
import resource
import sys
from pathlib import Path

from farfield_core.errors import FarfieldError

from farfield_worker.prepare.limits import Limits
from farfield_worker.prepare.pipeline import prepare


def main(argv: list[str]) -> int:
    """Run the command; the last line on standard output is one JSON object.

    {"ok": true, "triangles": n, "notes": [...]} with exit code 0, or {"ok": false, "error":
    sentence} with the error's exit code, 3 where the model was refused.
    """
    parser = argparse.ArgumentParser(prog="farfield_worker prepare")
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--id", required=True)
    parser.add_argument("--name", required=True)
    parser.add_argument("--memory-mb", type=int, default=0, help="0: no limit")
    parser.add_argument("--cpu-seconds", type=int, default=0, help="0: no limit")
    parser.add_argument("--up", choices=("y", "z"), default="y", help="the model's upward axis")
    parser.add_argument("--scale", type=float, default=1.0, help="metres in a unit of the model")
    parser.add_argument("--max-triangles", type=int, default=Limits.triangles)
    args = parser.parse_args(argv)
    if args.memory_mb > 0:
        # data, not address space: mapped files and drivers' reservations cost nothing
        size = args.memory_mb << 20
        resource.setrlimit(resource.RLIMIT_DATA, (size, size))
    if args.cpu_seconds > 0:
        resource.setrlimit(resource.RLIMIT_CPU, (args.cpu_seconds, args.cpu_seconds + 5))
    limits = Limits(triangles=args.max_triangles)
    try:
        info = prepare(
            args.source, args.out, args.id, args.name, limits, _tell, up=args.up, scale=args.scale
        )
    except FarfieldError as error:
        print(json.dumps({"ok": False, "error": str(error)}))
        return error.exit_code
    except OSError as error:
        why = f"{args.out} cannot be written: {error.strerror or error}."
        print(json.dumps({"ok": False, "error": why}))
        return 1
    print(json.dumps({"ok": True, "triangles": info.triangles, "notes": list(info.notes)}))
    return 0


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
