"""`python -m farfield_worker COMMAND ...`: how dispatchers start work in processes of its own."""

from __future__ import annotations

import importlib
import sys

#: command -> module whose `main(argv) -> exit code` runs it; imported only when asked for
COMMANDS = {
    "prepare": "farfield_worker.prepare.command",
    "cell": "farfield_worker.cell.command",
    "probe": "farfield_worker.probe",
}


def main(argv: list[str]) -> int:
    """Run the command named first in `argv`; returns the exit code."""
    if not argv or argv[0] not in COMMANDS:
        print(f"Use one of: {', '.join(COMMANDS)}.", file=sys.stderr)
        return 2
    module = importlib.import_module(COMMANDS[argv[0]])
    return int(module.main(argv[1:]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
