"""What goes wrong is said in words, tried again, and never leaves a hole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer


def alert(page: Page, url: str) -> str:
    """Open a page that fails and return what it says."""
    page.goto(url)
    return page.get_by_role("alert").inner_text()


def test_no_such_walk(visit: Visit, server: WalkServer) -> None:
    assert "There is no walk here" in alert(visit.page, f"{server.url}/walk/nowhere")


def test_no_walk_named(visit: Visit, server: WalkServer) -> None:
    assert "Which walk?" in alert(visit.page, f"{server.url}/walk/")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": 2}, "version 2"),
        ({"format": "something"}, "not a Farfield walk"),
        ({"light": {}}, "light"),
    ],
)
def test_unreadable_manifest(
    visit: Visit, server: WalkServer, room: Path, tmp_path: Path, change: object, says: str
) -> None:
    assert isinstance(change, dict)
    walk = json.loads((room / "walk.json").read_text())
    (tmp_path / "walk.json").write_text(json.dumps({**walk, **change}))
    server.walks["changed"] = tmp_path
    assert says in alert(visit.page, f"{server.url}/walk/changed")


def test_no_webgl2(visit: Visit, server: WalkServer) -> None:
    visit.page.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
        "  return kind === 'webgl2' ? null : get.call(this, kind, ...rest); };"
    )
    assert "WebGL 2" in alert(visit.page, f"{server.url}/walk/room")


def test_unbaked_start_waits_and_then_shows(visit: Visit, server: WalkServer) -> None:
    server.missing = {"/cells/"}
    visit.page.goto(f"{server.url}/walk/room?capture")
    visit.page.wait_for_function("window.farfield?.cellState('0_0_0') === 'absent'")
    server.missing = set()
    visit.page.evaluate("farfield.ready")
    assert (visit.pixels()[..., 3] == 255).all()


@pytest.mark.parametrize("fault", ["missing", "broken"])
def test_bad_atlas_page(visit: Visit, server: WalkServer, room: Path, fault: str) -> None:
    pages = {
        path.stem: json.loads(path.read_text())["atlases"]
        for path in sorted((room / "cells").iterdir())
    }
    others = {page for name, names in pages.items() if name != "1_0_0" for page in names}
    setattr(server, fault, {next(page for page in pages["1_0_0"] if page not in others)})
    visit.open(f"{server.url}/walk/room?capture")
    visit.call("farfield.frame(12, 2, 4, 0, 0)")
    visit.page.wait_for_function("farfield.cellState('1_0_0') === 'failed'")
    # The neighbour stands in, whole.
    report = visit.call("return farfield.frame(12, 2, 4, 0, 0)")
    assert report["wanted"] == "1_0_0"
    assert report["cell"] != "1_0_0"
    assert report["background"] == 0
    server.clear()
    visit.call("farfield.session.walk.retry(); await farfield.settled()")
    assert visit.call("return farfield.stats.cell") == "1_0_0"


def test_offline_and_back(visit: Visit, server: WalkServer, context: BrowserContext) -> None:
    server.delays = {"/cells/2_": 0.3}
    visit.open(f"{server.url}/walk/room?capture")
    context.set_offline(True)
    report = visit.call("return farfield.frame(20, 2, 4, 0, 0)")
    assert report["background"] == 0
    context.set_offline(False)
    server.clear()
    visit.call("await farfield.settled()")
    assert visit.call("return farfield.stats.cell") == "2_0_0"


def test_lost_context_comes_back(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room?capture")
    before = visit.pixels()
    visit.call(
        """
        const gl = farfield.session.renderer.getContext();
        const { canvas } = gl;
        const loss = gl.getExtension('WEBGL_lose_context');
        const lost = new Promise((done) => canvas.addEventListener('webglcontextlost', done));
        const back = new Promise((done) => canvas.addEventListener('webglcontextrestored', done));
        loss.loseContext();
        await lost;
        await new Promise((done) => setTimeout(done, 50));
        loss.restoreContext();
        await back;
        await farfield.settled();
        """
    )
    assert (visit.pixels() == before).all()
    assert visit.call("return farfield.stats.cell") == "0_0_0"
