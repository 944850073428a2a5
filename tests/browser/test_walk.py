"""Walking: across cell borders, with every input device, and under a memory cap."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser

from tests.browser.conftest import Visit
from tests.browser.oracle import draw_walk
from tests.browser.server import WalkServer

EAST = -math.pi / 2


def test_crosses_borders_without_a_missing_frame(
    visit: Visit, server: WalkServer, room: Path
) -> None:
    server.delays = {"/atlases/": 0.05, "/cells/": 0.05}
    visit.open(f"{server.url}/walk/room?capture#at=4,2,4,{EAST},0")
    frames = visit.call(
        """
        const frames = [];
        for (let n = 0; n < 240; n++) {
          const report = farfield.walk(0.05, { forward: 1 });
          const { textureBytes, textureCap } = farfield.stats;
          frames.push({ ...report, within: textureBytes <= textureCap });
          if (n % 2 === 0) await farfield.nextFrame();
        }
        return frames;
        """
    )
    assert [frame["background"] for frame in frames] == [0] * len(frames)
    assert all(frame["within"] for frame in frames)
    shown = [frame["cell"] for frame in frames]
    assert [cell for n, cell in enumerate(shown) if cell != shown[n - 1] or n == 0] == [
        "0_0_0",
        "1_0_0",
        "2_0_0",
    ]
    eyes = np.array([frame["eye"] for frame in frames])
    assert (np.diff(eyes[:, 0]) >= 0).all()
    # The corridor's end stops the walker, and nothing is shown but what the cell's files say.
    assert 23.5 < eyes[-1, 0] < 24
    wanted = draw_walk(room, shown[-1], tuple(eyes[-1]), EAST, 0.0, (256, 256))
    assert (np.abs(visit.pixels().astype(int) - wanted).max(axis=-1) > 2).mean() < 2e-4


def test_never_outruns_the_stream(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room?capture#at=4,2,4,{EAST},0")
    server.missing = {"/cells/1_0_"}
    visit.page.reload()
    visit.page.evaluate("farfield.ready")
    frames = visit.call(
        """
        const frames = [];
        for (let n = 0; n < 150; n++) {
          frames.push(farfield.walk(0.1, { forward: 1, fast: true }));
          if (n % 10 === 0) await farfield.nextFrame();
        }
        return frames;
        """
    )
    # Cell 1 is not baked: the walker sees cell 0, leaves it a little, and waits.
    assert {frame["cell"] for frame in frames} == {"0_0_0"}
    assert {frame["background"] for frame in frames} == {0}
    assert 8 < frames[-1]["eye"][0] < 8 + 0.75 * 4
    assert visit.call("return farfield.cellState('1_0_0')") == "absent"
    server.missing = set()
    visit.call("farfield.session.walk.retry(); await farfield.settled()")
    assert visit.call("return farfield.stats.cell") == "1_0_0"


def test_stays_under_a_small_cap(visit: Visit, server: WalkServer) -> None:
    visit.page.add_init_script(
        "Object.defineProperty(navigator, 'deviceMemory', { value: 4 });"
        # So few layers that two cells fit (of five or six pages), and not three.
        "const get = WebGL2RenderingContext.prototype.getParameter;"
        "WebGL2RenderingContext.prototype.getParameter = function (name) {"
        "  return name === this.MAX_ARRAY_TEXTURE_LAYERS ? 11 : get.call(this, name); };"
    )
    visit.open(f"{server.url}/walk/room?capture")
    for x, z, cell in ((12, 4, "1_0_0"), (20, 12, "2_0_1"), (4, 12, "0_0_1"), (4, 4, "0_0_0")):
        visit.go_to(x, 2, z, 0, 0)
        stats = visit.call("return farfield.stats")
        assert stats["cell"] == cell
        assert stats["textureBytes"] <= 11 * 128 * 128 * 4 + 1000
        assert (visit.pixels()[..., 3] == 255).all()


def test_keyboard_and_mouse(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room")
    visit.page.keyboard.down("w")
    visit.page.wait_for_function("farfield.session.walker.eye[2] < 3")
    visit.page.keyboard.up("w")
    visit.page.keyboard.down("e")
    visit.page.wait_for_function("farfield.session.walker.eye[1] > 2.5")
    visit.page.keyboard.up("e")
    visit.page.mouse.move(128, 128)
    visit.page.mouse.down()
    visit.page.mouse.move(168, 118, steps=4)
    visit.page.mouse.up()
    visit.page.wait_for_function("farfield.session.walker.yaw < -0.1")
    assert visit.call("return farfield.session.walker.pitch") > 0.02
    # The address follows, so that a reload comes back here.
    visit.page.wait_for_function("location.hash.startsWith('#at=4,')")


def test_touch(browser: Browser, server: WalkServer) -> None:
    context = browser.new_context(
        viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True
    )
    visit = Visit(context.new_page()).open(f"{server.url}/walk/room")
    devtools = context.new_cdp_session(visit.page)

    def touch(kind: str, *points: tuple[int, float, float]) -> None:
        devtools.send(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [{"id": n, "x": x, "y": y} for n, x, y in points]},
        )

    # Left thumb up: forward. Right thumb to the right at the same time: turn right.
    touch("touchStart", (0, 90, 550))
    touch("touchStart", (0, 90, 550), (1, 300, 550))
    touch("touchMove", (0, 90, 500), (1, 330, 550))
    visit.page.wait_for_function("farfield.session.walker.eye[2] < 3.5")
    visit.page.wait_for_function("farfield.session.walker.yaw < -0.1")
    touch("touchEnd")
    visit.page.wait_for_function("farfield.session.controls.stick === undefined")
    context.close()
    assert visit.errors == []


def test_deep_link_leads_there(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room?capture#at=20.5,1.5,13,0.75,-0.25")
    walker = visit.call(
        "const { eye, yaw, pitch } = farfield.session.walker; return [...eye, yaw, pitch]"
    )
    assert walker == [20.5, 1.5, 13, 0.75, -0.25]
    assert visit.call("return farfield.stats.cell") == "2_0_1"


def test_static_hosting(visit: Visit, server: WalkServer) -> None:
    walk = f"{server.url}/api/v1/walks/room/walk.json"
    visit.open(f"{server.url}/walk/index.html?capture&walk={walk}")
    assert visit.call("return farfield.stats.cell") == "0_0_0"


def test_a_cell_fades_into_the_next(visit: Visit, server: WalkServer) -> None:
    """On the way every pixel is one cell's or the other's, and some are each."""
    visit.page.set_viewport_size({"width": 320, "height": 240})
    before, after = (7.5, 2.0, 4.0, EAST, 0.0), (8.5, 2.0, 4.0, EAST, 0.0)
    visit.open(f"{server.url}/walk/room?capture&fade=3")
    visit.go_to(*before)
    visit.call("farfield.session.walk.frozen = true; farfield.session.stop();")
    visit.call(f"farfield.session.place({{ eye: {list(after[:3])}, yaw: {EAST}, pitch: 0 }});")
    going = visit.pixels()
    visit.call("farfield.session.walk.frozen = false;")
    visit.page.wait_for_function(
        "farfield.session.draw() ?? farfield.session.walk.cell.name !== '0_0_0'"
    )
    visit.page.wait_for_timeout(1000)
    between = visit.pixels()
    visit.page.wait_for_timeout(3000)
    come = visit.pixels()
    of_going, of_come = (between == going).all(axis=2), (between == come).all(axis=2)
    assert (of_going | of_come).all()
    differ = (going != come).any(axis=2)
    assert differ.mean() > 0.01
    assert 0.1 < of_come[differ].mean() < 0.9
