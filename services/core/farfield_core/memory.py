"""How much memory there is, and how much of it a process has to itself."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_CGROUP = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def machine_bytes() -> int:
    """Bytes of memory of this machine, or of the container that this process runs in."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for path in _CGROUP:
        with suppress(OSError, ValueError):  # "max" is no number
            total = min(total, int(Path(path).read_text(encoding="ascii")))
    return total


def own_bytes(process: int) -> int:
    """Bytes that a process does not share with files: 0 where it is gone or nobody can tell.

    A scene that many processes map at once does not count.
    """
    total = 0
    with suppress(OSError, ValueError, IndexError):
        for line in Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines():
            if line.startswith(("RssAnon:", "RssShmem:", "VmSwap:")):
                total += int(line.split()[1]) * 1024
    return total
