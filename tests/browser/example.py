"""Example pages of object impostors, driven by scripts, and how pictures are compared."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import BrowserContext

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer

Pixels = NDArray[np.uint8]


class Example(Visit):
    """An example page; nothing is drawn that the test does not draw."""

    def show(self, server: WalkServer, query: str) -> Example:
        self.page.goto(f"{server.url}/objects/index.html?script&{query}")
        self.page.wait_for_function("window.objects !== undefined")
        driver = self.page.evaluate("objects.stand.driver")
        assert "SwiftShader" not in driver, driver
        return self

    def picture(self) -> Pixels:
        """The last picture, (height, width, 3) uint8."""
        answer = self.call("return objects.stand.pixels()")
        raw = np.frombuffer(base64.b64decode(answer["data"]), np.uint8)
        return raw.reshape(answer["height"], answer["width"], 4)[..., :3]

    def stats(self) -> dict[str, Any]:
        stats = self.call("return objects.hooks.impostors.stats")
        assert isinstance(stats, dict)
        return stats


@pytest.fixture
def example(context: BrowserContext) -> Iterator[Example]:
    example = Example(context.new_page())
    yield example
    assert example.errors == []


def off(a: Pixels, b: Pixels) -> float:
    """Share of pixels without a match within 24/255 in the other's 3x3 pixels, both ways."""

    def unmatched(p: Pixels, q: Pixels) -> float:
        padded = np.pad(q.astype(int), ((1, 1), (1, 1), (0, 0)), mode="edge")
        best = np.full(p.shape[:2], 255)
        for dy in range(3):
            for dx in range(3):
                other = padded[dy : dy + p.shape[0], dx : dx + p.shape[1]]
                best = np.minimum(best, np.abs(other - p).max(axis=-1))
        return float((best > 24).mean())

    return max(unmatched(a, b), unmatched(b, a))
