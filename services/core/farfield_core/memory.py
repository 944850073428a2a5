"""How much memory there is, how much a process has to itself, and how much it had at its peak."""

from __future__ import annotations

import os
import resource
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
    return _status_bytes(str(process), ("RssAnon:", "RssShmem:", "VmSwap:"))


def peak_bytes() -> int:
    """The most memory that this process has had at once, shared or not, in bytes.

    `ru_maxrss` is not asked where the kernel tells better: a process that was forked and became
    another program inherits its parent's peak there.
    """
    peak = _status_bytes("self", ("VmHWM:",))
    return peak or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _status_bytes(process: str, fields: tuple[str, ...]) -> int:
    """Sum of fields of a process's status; 0 where it is gone or nobody can tell."""
    total = 0
    with suppress(OSError, ValueError, IndexError):
        for line in Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines():
            if line.startswith(fields):
                total += int(line.split()[1]) * 1024
    return total
