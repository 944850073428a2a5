"""`python -m farfield_worker probe`: one JSON line on what draws on this machine.

`{"name": ..., "software": ...}`, or `{"error": sentence}` where there is no OpenGL. It runs in a
process of its own, because a process that forks must never have had a GL context.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass

from farfield_core.errors import FarfieldError

#: renderers that run on the processor
_SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "swrast", "software")


@dataclass(frozen=True)
class Renderer:
    """GL vendor, renderer and version in one, and whether that is the processor."""

    name: str
    software: bool


def is_software(name: str) -> bool:
    """Whether a GL renderer of this name runs on the processor."""
    return any(word in name.lower() for word in _SOFTWARE)


def probe(command: tuple[str, ...] = (sys.executable, "-m", "farfield_worker")) -> Renderer:
    """What draws on this machine; raises FarfieldError where nothing does."""
    answer = subprocess.run(
        [*command, "probe"], capture_output=True, text=True, check=False, timeout=120
    )
    try:
        said = json.loads(answer.stdout.strip().rsplit("\n", 1)[-1])
    except ValueError:
        words = answer.stderr.strip().rsplit("\n", 1)[-1] or f"code {answer.returncode}"
        raise FarfieldError(f"OpenGL could not be tried on this machine: {words}.") from None
    if "error" in said:
        raise FarfieldError(str(said["error"]))
    return Renderer(str(said["name"]), bool(said["software"]))


def main(argv: list[str]) -> int:
    """Print what draws here; returns the exit code."""
    from farfield_worker.gl import context as gl  # noqa: PLC0415 - needs no GL before it is asked

    try:
        with gl.current() as context:
            name = gl.device_name(context)
    except Exception as error:  # whatever the driver comes up with
        print(json.dumps({"error": f"This machine offers no OpenGL: {error}."}))
        return 1
    print(json.dumps({"name": name, "software": is_software(name)}))
    return 0
