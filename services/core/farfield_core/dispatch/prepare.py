"""Preparing a scene in a process of its own.

The child `python -m farfield_worker prepare --source FILE --out DIR --id ID --name NAME` prints
`{"ok": true, ...}` or `{"ok": false, "error": "..."}` as its last line on standard output.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from farfield_core import layout, scenes
from farfield_core.errors import BadInputError, FarfieldError, NotFoundError, SceneRefusedError
from farfield_core.scene import SceneInfo
from farfield_core.store import Store

#: bytes of the child's output that are looked at
_LAST_WORDS = 1 << 16

COMMAND: tuple[str, ...] = (sys.executable, "-m", "farfield_worker", "prepare")


#: limits where nothing else is said, seconds
CPU_SECONDS, WALL_SECONDS = 7200, 3600


def most_memory_mb() -> int:
    """What preparing a scene may take where nothing else is said: 3/4 of all, 2**20 bytes."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") * 3 // 4 >> 20


@dataclass(frozen=True)
class PrepareLimits:
    """What preparing one scene may cost; 0: no limit.

    Attributes:
        memory_mb: memory of the process, 2**20 bytes.
        cpu_seconds: processor time of the process and its threads.
        wall_seconds: time by the clock.
    """

    memory_mb: int = 0
    cpu_seconds: int = 0
    wall_seconds: int = 0

    @classmethod
    def from_environment(cls, environ: Mapping[str, str]) -> PrepareLimits:
        """FARFIELD_PREPARE_MEMORY_MB, by default 3/4 of the machine's, _CPU_SECONDS and _SECONDS.

        Raises BadInputError.
        """

        def number(name: str, default: int) -> int:
            text = environ.get(name, "")
            if text and not text.isdecimal():
                raise BadInputError(f"{name} cannot be {text!r}; give a whole number, 0 for none.")
            return int(text) if text else default

        return cls(
            number("FARFIELD_PREPARE_MEMORY_MB", most_memory_mb()),
            number("FARFIELD_PREPARE_CPU_SECONDS", CPU_SECONDS),
            number("FARFIELD_PREPARE_SECONDS", WALL_SECONDS),
        )


def prepare_scene(
    store: Store,
    scene: str,
    command: Sequence[str] = COMMAND,
    stopped: Callable[[], bool] = lambda: False,
    limits: PrepareLimits | None = None,
) -> SceneInfo:
    """Prepare an uploaded scene unless it is ready already.

    `stopped` is asked a few times a second and ends the work. Raises NotFoundError, and
    SceneRefusedError with the reason, which the store then remembers.
    """
    try:
        return scenes.scene_info(store, scene)
    except NotFoundError:
        name = scenes.scene_state(store, scene).name
    # beside where it belongs, so that a store in a folder only renames it
    home = store.local_path(layout.scene_prefix(scene))
    with tempfile.TemporaryDirectory(prefix=".preparing-", dir=home) as work:
        model = scenes.source_model(store, scene, Path(work) / "copy")
        out = Path(work) / "prepared"
        arguments = ["--source", model, "--out", out, "--id", scene, "--name", name]
        limits = limits or PrepareLimits()
        if limits.memory_mb:
            arguments += ["--memory-mb", str(limits.memory_mb)]
        if limits.cpu_seconds:
            arguments += ["--cpu-seconds", str(limits.cpu_seconds)]
        arguments += scenes.orientation(store, scene).arguments()
        try:
            _run([*command, *map(str, arguments)], stopped, limits)
        except SceneRefusedError as error:
            scenes.refuse(store, scene, str(error))
            raise
        scenes.publish(store, scene, out)
    return scenes.scene_info(store, scene)


def _run(command: list[str], stopped: Callable[[], bool], limits: PrepareLimits) -> None:
    """Run the child to its end; raises SceneRefusedError with what it says or died of."""
    begun = time.monotonic()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as words:
        try:
            child = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=words, start_new_session=True
            )
        except OSError as error:
            raise FarfieldError(f"Preparing a scene could not begin: {error}.") from None
        try:
            while True:
                try:
                    code = child.wait(timeout=0.2)
                    break
                except subprocess.TimeoutExpired:
                    if stopped():
                        raise FarfieldError("Preparing the scene was stopped.") from None
                    if 0 < limits.wall_seconds < time.monotonic() - begun:
                        raise SceneRefusedError(
                            f"Preparing the model took more than {limits.wall_seconds} s, which "
                            "is all it may; make it smaller."
                        ) from None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()
        answer, last_words = _last_line(out), _last_line(words)
    try:
        said = json.loads(answer)
        good, reason = said.get("ok") is True, str(said.get("error", "no reason was given"))
    except (ValueError, AttributeError):
        if code == -signal.SIGXCPU:
            raise SceneRefusedError(
                f"Preparing the model took more than {limits.cpu_seconds} s of processor time, "
                "which is all it may; make it smaller."
            ) from None
        ending = f"was killed by signal {-code}" if code < 0 else f"ended with code {code}"
        good, reason = (
            False,
            f"The process that prepared the scene {ending}: {last_words or 'no word'}",
        )
    if not good:
        raise SceneRefusedError(reason)


def _last_line(file: IO[bytes]) -> str:
    file.seek(max(0, file.seek(0, os.SEEK_END) - _LAST_WORDS))
    return file.read().decode("utf-8", "replace").strip().rsplit("\n", 1)[-1]


class ScenePreparer:
    """Prepares scenes one after the other in the background; safe to call from any thread."""

    def __init__(
        self,
        store: Store,
        command: Sequence[str] = COMMAND,
        limits: PrepareLimits | None = None,
    ) -> None:
        self._store = store
        self._limits = limits
        self._command = tuple(command)
        self._waiting: list[str] = []
        self._changed = threading.Condition()
        self._closed = False
        self._errors: dict[str, str] = {}
        self._thread = threading.Thread(target=self._serve, name="farfield-preparer", daemon=True)
        self._thread.start()

    def submit(self, scene: str) -> None:
        """Prepare an uploaded scene; nothing happens if it waits already."""
        with self._changed:
            self._errors.pop(scene, None)
            if scene not in self._waiting:
                self._waiting.append(scene)
            self._changed.notify_all()

    def preparing(self, scene: str) -> bool:
        """Whether a scene is being prepared or waits for it."""
        with self._changed:
            return scene in self._waiting

    def error(self, scene: str) -> str | None:
        """Why preparing a scene failed though the scene was not refused, such as a full disk."""
        with self._changed:
            return self._errors.get(scene)

    def wait(self, scene: str, timeout: float | None = None) -> bool:
        """Wait until a scene is no longer being prepared; False after `timeout` seconds."""
        with self._changed:
            return self._changed.wait_for(lambda: scene not in self._waiting, timeout)

    def close(self) -> None:
        """Stop at once."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                scene = self._waiting[0]
            try:
                prepare_scene(self._store, scene, self._command, lambda: self._closed, self._limits)
            except SceneRefusedError:
                pass  # the store remembers why
            except (FarfieldError, OSError) as error:
                with self._changed:
                    self._errors[scene] = str(error)
            with self._changed:
                self._waiting.remove(scene)
                self._changed.notify_all()


def forget_scene(store: Store, scene: str) -> None:
    """Remove everything of a scene."""
    store.delete_prefix(layout.scene_prefix(scene))
    folder = store.local_path(layout.scene_prefix(scene))
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)
