"""A real browser for benches: Chromium on the machine's own GL, the built pages, baked walks."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).parents[1]
FRAMES = Path(__file__).with_name("walk_frames.js")
FLAGS = (
    "--use-gl=angle",
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--no-pings",
)


@contextmanager
def chromium() -> Iterator[Browser]:
    """Start the browser that FARFIELD_CHROMIUM names, or the one that is installed."""
    path = os.environ.get("FARFIELD_CHROMIUM")
    path = path or shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


@contextmanager
def served(store: Path) -> Iterator[str]:
    """Serve a store and the built pages; yields the address."""
    from farfield.server import Server  # noqa: PLC0415 - slow to import
    from farfield_api.app import create_app  # noqa: PLC0415
    from farfield_api.settings import ApiSettings  # noqa: PLC0415

    server = Server("127.0.0.1", 0)
    settings = ApiSettings.from_environment(os.environ, store=str(store), jobs=1)
    with server.beside(create_app(settings)):
        yield server.address


class Meter:
    """Processor time of this browser's graphics process and of its pages' main threads."""

    def __init__(self) -> None:
        parents: dict[int, int] = {}
        for stat in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        ours = {os.getpid()}
        while more := {pid for pid, parent in parents.items() if parent in ours} - ours:
            ours |= more
        self._files: list[Path] = []
        for pid in ours:
            with suppress(OSError):
                command = Path(f"/proc/{pid}/cmdline").read_text()
                if "--type=gpu-process" in command:
                    self._files += Path(f"/proc/{pid}/task").glob("*/schedstat")
                elif "--type=renderer" in command:
                    self._files.append(Path(f"/proc/{pid}/task/{pid}/schedstat"))

    def milliseconds(self) -> float:
        """Time spent up to now."""
        spent = 0
        for file in self._files:
            with suppress(OSError):
                spent += int(file.read_text().split()[0])
        return spent / 1e6


def bake(model: Path, corridor: dict[str, Any], out: Path, *options: str) -> str:
    """Bake with the command line into the store `out`; returns the bake's id."""
    out.mkdir(parents=True, exist_ok=True)
    file = out / "corridor.json"
    file.write_text(json.dumps(corridor), encoding="utf-8")
    command = [sys.executable, "-m", "farfield", "bake", str(model), "--corridor", str(file)]
    result = subprocess.run(
        [*command, "--out", str(out), "--cell-size", "14", "--json", *options],
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode != 0:
        raise RuntimeError(result.stderr)
    (walk,) = (out / "bakes").glob("*/walk.json")
    return walk.parent.name


def open_walk(
    browser: Browser, address: str, walk: str, width: int, height: int, more: str = ""
) -> Page:
    """Open a walk in a window of that size, with the bench's functions in the page."""
    page = browser.new_context(viewport={"width": width, "height": height}).new_page()
    page.add_init_script(path=FRAMES)
    page.goto(f"{address}/walk/{walk}?capture{more}")
    page.wait_for_function("window.farfield !== undefined")
    page.evaluate("farfield.ready")
    renderer = str(page.evaluate("farfield.renderer"))
    if "SwiftShader" in renderer:
        raise RuntimeError(f"Chromium fell back to {renderer}, whose times say nothing.")
    return page
