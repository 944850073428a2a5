"""The examples, built against the packages as npm would publish them, opened in a browser."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.browser.conftest import WEB, Visit
from tests.browser.server import WalkServer


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Packs, installs, checks and builds; fails if any of it does."""
    out = tmp_path_factory.mktemp("examples")
    subprocess.run(
        ["node", "scripts/build-examples.js", str(out)],
        cwd=WEB,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return out


def test_examples_work(visit: Visit, examples: Path, room: Path, tmp_path: Path) -> None:
    server = WalkServer(examples, {"room": room})
    page = visit.page
    try:
        for name, says in (
            ("minimal", "The painted room"),
            ("own-objects", "A cube in The painted room"),
            ("along-a-path", "Cell 1_0_0"),
        ):
            walk = f"{server.url}/api/v1/walks/room/walk.json"
            page.goto(f"{server.url}/{name}/index.html?walk={walk}")
            page.get_by_text(says).wait_for(timeout=60_000)
            page.wait_for_timeout(500)
            shot = tmp_path / f"{name}.png"
            page.screenshot(path=shot)
            from PIL import Image

            picture = np.asarray(Image.open(shot).convert("RGB")).astype(int)
            magenta = (np.abs(picture - (255, 0, 255)).max(axis=-1) < 3).mean()
            assert (magenta > 0.01) == (name == "own-objects"), name
            assert len(np.unique(picture.reshape(-1, 3) // 32, axis=0)) > 10, name
    finally:
        server.close()
