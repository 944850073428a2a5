"""The whole way as a new user goes it: drop a model, draw a walk, bake it, step into it.

Normally with a small city; the soak drops the town of two million triangles and takes the time.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from farfield_worker.demo.city import write_city
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import Visit
from tests.browser.test_pages import keep
from tests.corridors.scenes import DATA
from tests.integration.live import Live, serving

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
DESK, PHONE = (1280, 800), (390, 780)
TOWN = DATA / "medieval_town/medieval_town_2M.glb"


@pytest.fixture(scope="module")
def live(pages: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    folder = tmp_path_factory.mktemp("journey")
    with serving(folder / "store", "--jobs", "2", FARFIELD_WEB=str(pages)) as live:
        yield live


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("city") / "Lake city.glb"
    write_city(path, 60_000)
    return path


def numbers(page: Page) -> dict[str, str]:
    """The plan as the page shows it."""
    found = page.get_by_label("Plan").evaluate(
        "list => Object.fromEntries([...list.children]"
        ".map(row => [...row.children].map(cell => cell.textContent)))"
    )
    assert isinstance(found, dict)
    return found


def test_from_a_file_to_the_first_step(
    browser: Browser, live: Live, city: Path, tmp_path: Path
) -> None:
    width, height = DESK
    context = browser.new_context(viewport={"width": width, "height": height})
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    visit = Visit(context.new_page())
    page = visit.page
    page.goto(f"{live.url}/")
    page.get_by_text("nothing to walk through yet").wait_for()
    keep(page, tmp_path, "journey-1-front")
    page.get_by_label("Model file").set_input_files(city)
    page.wait_for_url("**/scene/*")
    page.get_by_role("heading", name="Lake city").wait_for()
    bake = page.get_by_role("button", name="Bake this walk")
    expect(bake).to_be_enabled(timeout=60_000)
    page.wait_for_load_state("networkidle")
    picture = keep(page, tmp_path, "journey-2-scene")
    # the map shows the town, not one colour
    assert len(np.unique(picture[100:700, 50:850].reshape(-1, 3), axis=0)) > 1000

    draw(page, tmp_path)
    bake_and_walk(visit, tmp_path)
    context.close()
    assert visit.errors == []


def draw(page: Page, tmp_path: Path) -> None:
    """The plan follows what is drawn."""
    bake = page.get_by_role("button", name="Bake this walk")
    suggested = numbers(page)
    page.get_by_role("button", name="Draw path").click()
    map_ = page.get_by_role("img")
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_label("Plan").get_by_text(suggested["Cells"], exact=True)).to_have_count(0)
    page.get_by_role("button", name="Draw box").click()
    box = map_.bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 40, middle[1] + 30, steps=4)
    expect(bake).to_be_enabled()
    small = numbers(page)
    page.mouse.move(middle[0] + 240, middle[1] + 30, steps=4)
    page.mouse.up()
    page.wait_for_function(
        "cells => document.querySelector('.plan dd').textContent > cells", arg=small["Cells"]
    )
    keep(page, tmp_path, "journey-3-box")
    page.get_by_role("button", name="Suggest").click()


def bake_and_walk(visit: Visit, tmp_path: Path) -> None:
    """Bake in larger cells than suggested, share the link, step into the walk."""
    page = visit.page
    bake = page.get_by_role("button", name="Bake this walk")
    cells = numbers(page)["Cells"]
    page.get_by_label("Detail").select_option("256")
    page.get_by_label("Cell size").fill("30")
    expect(page.get_by_label("Plan")).not_to_contain_text(f"Cells{cells}P")
    expect(bake).to_be_enabled()
    bake.click()

    page.wait_for_url("**/bake/*")
    walk = page.get_by_role("link", name="Walk", exact=False).filter(has_text="Walk")
    page.get_by_role("link", name="Walk while it bakes").or_(
        page.get_by_role("link", name="Walk", exact=True)
    ).wait_for(timeout=240_000)
    page.wait_for_load_state("load")
    keep(page, tmp_path, "journey-4-bake")
    page.get_by_role("button", name="Copy link").click()
    page.get_by_role("button", name="Link copied").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    assert "/walk/" in link
    walk.first.click()
    page.wait_for_url("**/walk/*")
    assert page.url.split("#")[0] == link
    page.wait_for_function("window.farfield !== undefined")
    page.evaluate("farfield.ready")
    eye = "return [...farfield.session.walker.eye]"
    first = visit.call(eye)
    page.keyboard.down("w")
    page.wait_for_timeout(600)
    page.keyboard.up("w")
    assert visit.call(eye) != first
    picture = keep(page, tmp_path, "journey-5-walk")
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 300


def test_the_same_pages_on_a_phone(browser: Browser, live: Live, tmp_path: Path) -> None:
    """Runs after the journey, over the store that it left."""
    with live.client() as client:
        bake = client.get("bakes").json()["bakes"][0]
    width, height = PHONE
    context = browser.new_context(
        viewport={"width": width, "height": height}, has_touch=True, is_mobile=True
    )
    visit = Visit(context.new_page())
    page = visit.page
    for path, name, ready in (
        ("", "front", page.get_by_role("heading", name="Walks")),
        (f"scene/{bake['scene']}", "scene", page.get_by_role("button", name="Bake this walk")),
        (f"bake/{bake['id']}", "bake", page.get_by_role("button", name="Copy link")),
    ):
        page.goto(f"{live.url}/{path}")
        ready.wait_for()
        page.wait_for_load_state("load")
        page.wait_for_timeout(300)
        keep(page, tmp_path, f"phone-{name}")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
    # a finger draws
    page.goto(f"{live.url}/scene/{bake['scene']}")
    button = page.get_by_role("button", name="Bake this walk")
    expect(button).to_be_enabled()
    before = numbers(page)
    page.get_by_role("button", name="Draw path").tap()
    page.touchscreen.tap(60, 60)
    page.wait_for_function(
        "cells => !['–', cells].includes(document.querySelector('.plan dd').textContent)",
        arg=before["Cells"],
    )
    context.close()
    assert visit.errors == []


def test_refusals_are_told_on_the_page(browser: Browser, live: Live, tmp_path: Path) -> None:
    context = browser.new_context(viewport={"width": 900, "height": 600})
    page = context.new_page()
    page.goto(f"{live.url}/")
    field = page.get_by_label("Model file")
    field.set_input_files({"name": "notes.txt", "mimeType": "text/plain", "buffer": b"no model"})
    page.get_by_text("notes.txt cannot be read as a model").wait_for()
    broken = {"name": "bad.glb", "mimeType": "model/gltf-binary", "buffer": b"no model at all"}
    field.set_input_files(broken)
    page.wait_for_url("**/scene/*")
    page.get_by_role("heading", name="bad cannot be used").wait_for(timeout=60_000)
    keep(page, tmp_path, "refused")
    context.close()


@pytest.mark.skipif(not (SOAK and TOWN.exists()), reason="the town is walked in the soak")
def test_the_town_within_a_minute(browser: Browser, live: Live) -> None:
    """From dropping medieval_town_2M.glb to the first step, on an idle pair of cores."""
    context = browser.new_context(viewport={"width": DESK[0], "height": DESK[1]})
    page = context.new_page()
    page.goto(f"{live.url}/")
    begun = time.monotonic()
    page.get_by_label("Model file").set_input_files(TOWN)
    page.wait_for_url("**/scene/*", timeout=120_000)
    bake = page.get_by_role("button", name="Bake this walk")
    expect(bake).to_be_enabled(timeout=120_000)
    bake.click()
    page.wait_for_url("**/bake/*")
    walk = page.get_by_role("link", name="Walk while it bakes")
    walk.wait_for(timeout=240_000)
    walk.click()
    page.wait_for_function("window.farfield !== undefined")
    page.evaluate("farfield.ready")
    seconds = time.monotonic() - begun
    print(f"from the file to the first step: {seconds:.1f} s")
    context.close()
    assert seconds < 60
