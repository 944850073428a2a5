"""What a process says of its memory."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
from farfield_core.memory import own_bytes

SAY_PEAK = "from farfield_core.memory import peak_bytes; print(peak_bytes())"
#: what a process of its own says of a block that it takes and gives back
TAKE = """
import os
import numpy as np
from farfield_core.memory import own_bytes, peak_bytes
before = peak_bytes()
block = np.ones(2**28, np.uint8)
own = own_bytes(os.getpid())
del block
print(before, own, peak_bytes(), own_bytes(os.getpid()))
"""


def test_the_peak_holds_what_was_there_at_once_and_is_kept() -> None:
    said = subprocess.run([sys.executable, "-c", TAKE], capture_output=True, check=True)
    before, with_block, peak, after = map(int, said.stdout.split())
    assert before < 2**28 < with_block
    assert peak > before + 0.9 * 2**28
    assert after < with_block - 0.9 * 2**28


def test_the_peak_is_not_inherited() -> None:
    block = np.ones(2**28, np.uint8)
    said = subprocess.run([sys.executable, "-c", SAY_PEAK], capture_output=True, check=True)
    assert 2**20 < int(said.stdout) < len(block)


def test_a_process_that_is_gone_has_no_memory() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert own_bytes(process.pid) == 0
