"""What a process says of its memory."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
from farfield_core.memory import own_bytes, peak_bytes

SAY_PEAK = "from farfield_core.memory import peak_bytes; print(peak_bytes())"


def test_the_peak_holds_what_was_there_at_once_and_is_kept() -> None:
    before = peak_bytes()
    size = max(2 * before, 2**28)
    block = np.ones(size, np.uint8)
    with_block = peak_bytes()
    own = own_bytes(os.getpid())
    del block
    assert own > size
    assert with_block >= own
    assert peak_bytes() >= with_block


def test_the_peak_is_not_inherited() -> None:
    block = np.ones(2**28, np.uint8)
    said = subprocess.run([sys.executable, "-c", SAY_PEAK], capture_output=True, check=True)
    assert 2**20 < int(said.stdout) < len(block)


def test_a_process_that_is_gone_has_no_memory() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert own_bytes(process.pid) == 0
