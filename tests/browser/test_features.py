"""What the page offers beside walking: ground, gamepad, overlays, comparison, playback, headset."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer

EAST = -math.pi / 2
#: the path's own address, not that of a page that names it
PATH = re.compile(r"^[^?]*/path\.json$")
#: a place over the fixture's long box, and the height of its top
PLACE, GROUND = (21.0, 2.0, 15.0), -0.7


def write_scene(folder: Path) -> None:
    """A prepared scene by hand: one green square, 12 m wide, that faces south."""
    folder.mkdir(parents=True)
    corners = np.array([[-6, -6, 0], [6, -6, 0], [6, 6, 0], [-6, 6, 0]])
    np.save(folder / "positions.npy", corners.astype(np.float32))
    np.save(folder / "normals.npy", np.tile(np.array([0, 0, 127, 0], np.int8), (4, 1)))
    np.save(folder / "uvs.npy", np.zeros((4, 2), np.float32))
    np.save(folder / "colors.npy", np.tile(np.array([0, 65535, 0, 65535], np.uint16), (4, 1)))
    np.save(folder / "triangles.npy", np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    batch = {"texture": None, "emissive_texture": None, "emissive": [0, 0, 0]}
    looks = {"alpha": "opaque", "cutoff": 0.5, "double_sided": False, "unlit": True}
    part = {"batch": 0, "first_triangle": 0, "triangles": 2}
    scene = {
        "origin": [4.0, 2.0, -4.0],
        "triangles": 2,
        "textures": [],
        "batches": [batch | looks],
        "blocks": [{"parts": [part]}],
    }
    (folder / "scene.json").write_text(json.dumps(scene))


def pad(page: Page, **state: object) -> None:
    """Plug a gamepad in, or change what it says."""
    text = json.dumps({"mapping": "standard", "axes": [0, 0, 0, 0], "buttons": [], **state})
    page.evaluate(f"navigator.getGamepads = () => [null, {text}]")


def test_a_walk_begins_at_eye_level(visit: Visit, server: WalkServer, room: Path) -> None:
    walk = json.loads((room / "walk.json").read_text())
    walk["start"] = {"eye": PLACE, "yaw": 0.0, "pitch": 0.0}
    visit.page.route("**/walk.json", lambda route: route.fulfill(body=json.dumps(walk)))
    visit.open(f"{server.url}/walk/room")
    visit.page.wait_for_function(
        f"Math.abs(farfield.session.walker.eye[1] - ({GROUND} + 1.7)) < 0.01"
    )
    # A height that a link asks for is kept.
    visit.open(f"{server.url}/walk/room?again#at=21,2.5,15,0,0")
    visit.page.wait_for_timeout(500)
    assert visit.call("return farfield.session.walker.eye[1]") == pytest.approx(2.5, abs=0.01)


def test_walls_stop_a_walker_and_not_a_flyer(visit: Visit, server: WalkServer) -> None:
    # The box "opaque" stands at x 8.3 to 9.7, z -3 to -2: outside the corridor. A wall inside it
    # is put into what the shown cell takes for solid.
    visit.open(f"{server.url}/walk/room#at=4,1,6,0,0")
    visit.call(
        """
        const { session } = farfield;
        const wall = { ground: () => -0.7, push: (x, z) => [x, Math.max(z, 3)] };
        Object.defineProperty(session.walk, 'solid', { get: () => wall });
        session.stop();
        """
    )
    walk = (
        "for (let n = 0; n < 120; n++) farfield.session.step(0.05,"
        " { right: 0, forward: 1, up: 0, yaw: 0, pitch: 0, fast: false });"
        " return farfield.session.walker.eye[2]"
    )
    assert visit.call(walk) == pytest.approx(3, abs=1e-6)
    assert visit.call("farfield.session.walker.flying = true;" + walk) < 1


def test_the_edge_of_the_corridor_says_why(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room#at=4,2,1.5,0,0")
    visit.page.keyboard.down("w")
    visit.page.get_by_text("The corridor ends here: nothing beyond it is baked.").wait_for()
    visit.page.keyboard.up("w")


def test_gamepad(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room#at=4,2,4,0,0")
    pad(visit.page, axes=[0, -1, 0.8, 0])
    visit.page.wait_for_function("farfield.session.walker.yaw < -0.2")
    visit.page.wait_for_function("farfield.session.walker.eye[2] < 3.5")
    up = [{"pressed": n == 3, "value": 0} for n in range(12)]
    pad(visit.page, buttons=up)
    visit.page.wait_for_function("farfield.session.walker.flying")
    visit.page.wait_for_timeout(200)
    # Held down it changes once.
    assert visit.call("return farfield.session.walker.flying")


def test_overlays_and_freeze(visit: Visit, server: WalkServer) -> None:
    visit.page.set_viewport_size({"width": 900, "height": 640})
    visit.open(f"{server.url}/walk/room#at=4,2,4,0,0")
    page = visit.page
    visit.call("farfield.session.stop()")

    def picture() -> np.ndarray:
        return visit.pixels()[:, :600, :3].astype(int)

    plain = picture()
    changed = {}
    for name in ("Quads", "Outlines", "Border"):
        page.get_by_label(name).check()
        changed[name] = (np.abs(picture() - plain).max(axis=-1) > 8).mean()
        page.get_by_label(name).uncheck()
        assert (picture() == plain).all(), name
    assert changed["Quads"] > 0.3
    assert 0.0005 < changed["Outlines"] < 0.3
    assert changed["Border"] > 0.01
    page.get_by_label("Freeze").check()
    visit.call("farfield.session.place({ eye: [20, 2, 4], yaw: 0, pitch: 0 })")
    visit.call(
        "for (let n = 0; n < 20; n++) { farfield.session.draw(); await farfield.nextFrame(); }"
    )
    assert visit.call("return farfield.stats.cell") == "0_0_0"
    page.get_by_label("Freeze").uncheck()
    visit.call("await farfield.settled()")
    assert visit.call("return farfield.stats.cell") == "2_0_0"


def test_comparison_with_the_full_model(
    visit: Visit, server: WalkServer, room: Path, tmp_path: Path
) -> None:
    # As in a store: the bake's folder, and the scene's two folders up from it.
    store = tmp_path / "store"
    (store / "bakes").mkdir(parents=True)
    (store / "bakes" / "room").symlink_to(room)
    write_scene(store / "scenes" / "room" / "prepared")
    server.walks["store"] = store
    walk = f"{server.url}/api/v1/walks/store/bakes/room/walk.json"
    visit.page.set_viewport_size({"width": 800, "height": 500})
    visit.open(f"{server.url}/walk/index.html?walk={walk}#at=4,2,4,0,0")
    page = visit.page
    page.get_by_role("button", name="Compare").click()
    page.get_by_text("Full model, 2 triangles").wait_for()
    before = visit.pixels()[..., :3].astype(int)
    # The model's green square right of the middle, the walk left of it.
    assert (before[250, 405:600] == (0, 255, 0)).all()
    assert not (before[250, 200:395] == (0, 255, 0)).all(axis=-1).any()
    handle = page.get_by_role("slider")
    handle.focus()
    for _ in range(10):
        page.keyboard.press("ArrowLeft")
    assert handle.get_attribute("aria-valuenow") == "30"
    after = visit.pixels()[..., :3].astype(int)
    assert (after[250, 300:600] == (0, 255, 0)).all()
    box = handle.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(640, 300, steps=3)
    page.mouse.up()
    assert handle.get_attribute("aria-valuenow") == "80"
    page.get_by_role("button", name="Compare").click()
    whole = visit.pixels()[..., :3].astype(int)
    assert not (whole[250] == (0, 255, 0)).all(axis=-1).any()


def test_a_model_that_is_not_there_is_told(visit: Visit, server: WalkServer) -> None:
    visit.page.set_viewport_size({"width": 800, "height": 500})
    visit.open(f"{server.url}/walk/room")
    visit.page.get_by_role("button", name="Compare").click()
    assert "can’t be shown" in visit.page.get_by_role("alert").inner_text()
    visit.page.get_by_role("button", name="Back to the walk").click()
    visit.page.get_by_role("alert").wait_for(state="detached")


def test_a_recorded_path_plays_back(visit: Visit, server: WalkServer) -> None:
    poses = [[4 + 0.2 * n, 2, 4, EAST, 0.1] for n in range(81)]
    path = {"format": "farfield-path", "version": 1, "rate": 30, "poses": poses}
    visit.page.route(PATH, lambda route: route.fulfill(body=json.dumps(path)))
    visit.open(f"{server.url}/walk/room?path=/path.json")
    visit.page.wait_for_function("farfield.session.walker.eye[0] > 6")
    visit.page.wait_for_function("farfield.session.walker.eye[0] > 19.9", timeout=60_000)
    walker = visit.call(
        "const { eye, yaw, pitch } = farfield.session.walker; return [...eye, yaw, pitch]"
    )
    assert walker == pytest.approx([20, 2, 4, EAST, 0.1], abs=0.05)
    visit.call("await farfield.settled()")
    assert visit.call("return farfield.stats.cell") == "2_0_0"


def test_recording_gives_a_path_that_plays(
    visit: Visit, server: WalkServer, tmp_path: Path
) -> None:
    visit.open(f"{server.url}/walk/room#at=4,2,6,0,0")
    visit.page.keyboard.press("k")
    visit.page.get_by_text("Recording your path").wait_for()
    visit.page.keyboard.down("w")
    visit.page.wait_for_function("farfield.session.walker.eye[2] < 5")
    visit.page.keyboard.up("w")
    with visit.page.expect_download() as download:
        visit.page.keyboard.press("k")
    download.value.save_as(tmp_path / "path.json")
    path = json.loads((tmp_path / "path.json").read_text())
    assert path["format"] == "farfield-path"
    south = [pose[2] for pose in path["poses"]]
    assert south[0] == pytest.approx(6, abs=0.1)
    assert south[-1] < 5.2
    assert sorted(south, reverse=True) == south


@pytest.mark.parametrize(
    ("body", "says"),
    [("{}", "not a path of version 1"), ("walk", "not JSON"), (None, "no path to play")],
)
def test_a_bad_path_is_told(visit: Visit, server: WalkServer, body: str | None, says: str) -> None:
    status = 404 if body is None else 200
    visit.page.route(PATH, lambda route: route.fulfill(status=status, body=body or "nothing"))
    visit.page.goto(f"{server.url}/walk/room?path=/path.json")
    assert says in visit.page.get_by_role("alert").inner_text()


def test_offline_is_said(visit: Visit, server: WalkServer) -> None:
    visit.open(f"{server.url}/walk/room")
    visit.page.context.set_offline(True)
    visit.page.get_by_text("You are offline.").wait_for()
    visit.page.context.set_offline(False)
    visit.page.wait_for_function(
        "document.querySelector('.remark').dataset.shown === 'false'", timeout=10_000
    )


def test_a_headset_is_offered_where_there_is_one(visit: Visit, server: WalkServer) -> None:
    visit.page.add_init_script(
        "window.asked = [];"
        "Object.defineProperty(navigator, 'xr', { value: {"
        "  addEventListener() {},"
        "  isSessionSupported: async (mode) => mode === 'immersive-vr',"
        "  requestSession: async (mode) => { window.asked.push(mode);"
        "    throw new DOMException('no', 'NotAllowedError'); } } });"
    )
    visit.open(f"{server.url}/walk/room")
    visit.page.get_by_role("button", name="VR").click()
    visit.page.wait_for_function("window.asked.length === 1")
    # A refusal leaves the walk as it was.
    assert visit.call("return farfield.session.headset.active") is False
