"""One child process that bakes cells of one bake, one at a time.

It says `{"ready": true}` once, then answers each line "<cell>" on its standard input with one
line, `{"cell": ..., "ok": true, "figures": {...}}` or `{"cell": ..., "ok": false, "error": "..."}`.
An answer with `"store": true` says that the store is to blame, as does an end with the exit code of
a StoreError. It ends when its input does. Whatever else it prints, dies of or waits for is told as
an ExecutorError, and so is taking more memory than it may.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

from farfield_core.memory import own_bytes
from farfield_core.store import StoreError

#: how to start a child; "--store S --bake ID" is added
COMMAND: tuple[str, ...] = (sys.executable, "-m", "farfield_worker", "cell")

_LINE_LIMIT = 1 << 20
#: seconds between looks at the child's memory
_MEMORY_LOOK = 0.2


class ExecutorError(Exception):
    """The child died, hung or spoke nonsense; it has to be replaced."""


class CellError(Exception):
    """The child is well, but says that it cannot bake the cell."""


class StoreFaultError(Exception):
    """The child could not read or write the store: neither it nor the cell is to blame."""


class Executor:
    """A child process for the cells of `bake` in the store at `store`.

    It is killed when it has more than `memory` bytes to itself.
    """

    def __init__(
        self,
        store: str,
        bake: str,
        command: Sequence[str] = COMMAND,
        environment: Mapping[str, str] | None = None,
        memory: int | None = None,
    ) -> None:
        self.bake = bake
        self.renderer = ""
        self._verdict = ""
        self._ready = False
        self._answers: queue.Queue[bytes | None] = queue.Queue(maxsize=64)
        self._words: deque[str] = deque(maxlen=20)
        self._child = subprocess.Popen(
            [*command, "--store", store, "--bake", bake],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=None if environment is None else dict(environment),
            # Ctrl-C is for the parent, which ends its children in order
            start_new_session=True,
        )
        assert self._child.stdout
        assert self._child.stderr
        self._readers = [
            threading.Thread(target=self._read_answers, args=(self._child.stdout,), daemon=True),
            threading.Thread(target=self._read_words, args=(self._child.stderr,), daemon=True),
        ]
        if memory is not None:
            self._readers.append(
                threading.Thread(target=self._watch_memory, args=(memory,), daemon=True)
            )
        for reader in self._readers:
            reader.start()

    @property
    def ready(self) -> bool:
        """Whether the child has said that it is ready."""
        return self._ready

    def wait_ready(self, timeout: float) -> None:
        """Wait until the child can bake; raises ExecutorError and StoreFaultError."""
        if not self._ready:
            try:
                answer = self._answer(timeout)
            except ExecutorError as error:
                if self._child.poll() == StoreError.exit_code:
                    raise StoreFaultError(str(error)) from None
                raise
            if answer.get("ready") is not True:
                raise ExecutorError(str(answer.get("error", "It began with something else.")))
            self.renderer = str(answer.get("renderer", ""))
            self._ready = True

    def bake_cell(self, cell: str, timeout: float) -> dict[str, float]:
        """Bake one cell and return its figures.

        Raises CellError, ExecutorError and StoreFaultError.
        """
        assert self._child.stdin
        try:
            self._child.stdin.write(cell.encode() + b"\n")
            self._child.stdin.flush()
        except OSError:
            raise ExecutorError(self._death()) from None
        answer = self._answer(timeout)
        if answer.get("cell") != cell:
            raise ExecutorError(f"The process answered for {answer.get('cell')!r} instead.")
        if answer.get("store") is True:
            raise StoreFaultError(str(answer.get("error", "The store failed.")))
        if answer.get("ok") is not True:
            raise CellError(str(answer.get("error", "No reason was given.")))
        figures = answer.get("figures", {})
        if not isinstance(figures, dict):
            raise ExecutorError("The process gave figures that are none.")
        return {str(k): float(v) for k, v in figures.items() if isinstance(v, int | float)}

    @property
    def memory(self) -> int:
        """Bytes that the child has to itself."""
        return own_bytes(self._child.pid)

    def kill(self) -> None:
        """End the child at once; callers in `bake_cell` get an ExecutorError."""
        if self._child.poll() is None:
            # what it may have started goes too: it would keep the pipes open
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)

    def close(self) -> None:
        """End the child, at once if it is busy, and free everything."""
        self.kill()
        self._child.wait()
        # the reader may be stuck on a full queue
        while self._readers[0].is_alive():
            with suppress(queue.Empty):
                self._answers.get(timeout=0.05)
        for reader in self._readers:
            reader.join()
        for pipe in (self._child.stdin, self._child.stdout, self._child.stderr):
            assert pipe
            with suppress(BrokenPipeError):  # an unread line was still on its way
                pipe.close()

    def _answer(self, timeout: float) -> dict[str, Any]:
        try:
            line = self._answers.get(timeout=timeout)
        except queue.Empty:
            raise ExecutorError(f"The process gave no answer for {timeout:g} s.") from None
        if line is None:
            raise ExecutorError(self._death())
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            text = line[:80].decode("utf-8", "replace").strip()
            raise ExecutorError(f"The process answered with something else than JSON: {text!r}.")
        return answer

    def _death(self) -> str:
        """How the child ended, and its last words."""
        try:
            code = self._child.wait(timeout=10)
        except subprocess.TimeoutExpired:
            return "The process closed its output and went on."
        if self._verdict:
            return self._verdict
        self._readers[1].join(timeout=1)
        if code < 0:
            try:
                how = f"was killed by {signal.Signals(-code).name}"
            except ValueError:
                how = f"was killed by signal {-code}"
        else:
            how = f"ended with code {code}"
        words = next((word for word in reversed(self._words) if word), "")
        return f"The process {how}" + (f"; its last words: {words}" if words else ".")

    def _read_answers(self, pipe: IO[bytes]) -> None:
        while line := pipe.readline(_LINE_LIMIT):
            self._answers.put(line)
        self._answers.put(None)

    def _read_words(self, pipe: IO[bytes]) -> None:
        while line := pipe.readline(_LINE_LIMIT):
            self._words.append(line.decode("utf-8", "replace").strip()[:500])

    def _watch_memory(self, limit: int) -> None:
        while self._child.returncode is None:
            if self.memory > limit:
                self._verdict = f"The process took more than {limit / 1e6:.0f} MB of memory."
                self.kill()
                return
            time.sleep(_MEMORY_LOOK)
