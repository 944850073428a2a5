"""A real browser, the built pages and a small walk."""

from __future__ import annotations

import base64
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    sync_playwright,
)

from tests.browser.room import write_room
from tests.browser.server import WalkServer

WEB = Path(__file__).parents[2] / "web"

FLAGS = [
    "--use-gl=angle",
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--no-pings",
]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium on the machine's own GL."""
    path = os.environ.get("FARFIELD_CHROMIUM")
    path = path or shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The web app, built from the sources as they are, where no other run of tests builds it."""
    folder = tmp_path_factory.mktemp("pages")
    subprocess.run(
        [
            *("npm", "run", "build", "--silent", "-w", "@farfield/app"),
            *("--", "--outDir", str(folder), "--emptyOutDir"),
        ],
        cwd=WEB,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    return folder


@pytest.fixture(scope="session")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the painted room's walk."""
    return write_room(tmp_path_factory.mktemp("room")).parent


@pytest.fixture(scope="session")
def smooth_room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with filtered, mipmapped textures."""
    return write_room(tmp_path_factory.mktemp("smooth"), smooth=True).parent


@pytest.fixture(scope="session")
def _server(pages: Path, room: Path, smooth_room: Path) -> Iterator[WalkServer]:
    server = WalkServer(pages, {"room": room, "smooth": smooth_room})
    yield server
    server.close()


@pytest.fixture
def server(_server: WalkServer) -> WalkServer:
    """The test server, without faults."""
    _server.clear()
    return _server


class Visit:
    """A page with a walk in it."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.errors: list[str] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self._note)

    def _note(self, message: ConsoleMessage) -> None:
        # The browser reports every 404; which of them are right is for a test to say.
        expected = ("Failed to load resource", "GPU stall due to ReadPixels")
        if message.type in ("error", "warning") and not any(e in message.text for e in expected):
            self.errors.append(message.text)

    def open(self, url: str) -> Visit:
        """Go to a walk and wait until its first cell is drawn."""
        self.page.goto(url)
        self.page.wait_for_function("window.farfield !== undefined")
        self.page.evaluate("farfield.ready")
        renderer = self.page.evaluate("farfield.renderer")
        assert "SwiftShader" not in renderer, renderer
        return self

    def call(self, script: str, *args: Any) -> Any:
        """Evaluate a function body with `args`."""
        return self.page.evaluate(f"async (args) => {{ {script} }}", list(args))

    def go_to(self, *pose: float) -> None:
        """Stand at x, y, z, yaw, pitch and wait for the cell there."""
        self.call("await farfield.goTo(...args)", *pose)

    def pixels(self) -> NDArray[np.uint8]:
        """The picture, (height, width, 4) uint8, alpha 0 where the background shows."""
        answer = self.call(
            """
            const { width, height, data } = farfield.pixels();
            let text = '';
            for (let n = 0; n < data.length; n += 32768)
              text += String.fromCharCode(...data.subarray(n, n + 32768));
            return { width, height, text: btoa(text) };
            """
        )
        raw = np.frombuffer(base64.b64decode(answer["text"]), np.uint8)
        return raw.reshape(answer["height"], answer["width"], 4)


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A window of 256 x 256 pixels."""
    context = browser.new_context(viewport={"width": 256, "height": 256})
    yield context
    context.close()


@pytest.fixture
def visit(context: BrowserContext) -> Iterator[Visit]:
    """A page; the test fails if the page reports an error that the test did not clear."""
    visit = Visit(context.new_page())
    yield visit
    assert visit.errors == []
