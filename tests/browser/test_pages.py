"""How the pages look and what they say, at desk and phone size."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from tests.browser.conftest import Visit
from tests.browser.server import WalkServer

SIZES = {"desk": (1280, 720), "phone": (390, 780), "phone-lying": (780, 360)}


def keep(page: Page, folder: Path, name: str) -> np.ndarray:
    """Take a screenshot; FARFIELD_SCREENSHOTS names a folder to keep it in."""
    folder = Path(os.environ.get("FARFIELD_SCREENSHOTS", folder))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.png"
    page.screenshot(path=path)
    return np.asarray(Image.open(path).convert("RGB"))


@pytest.mark.parametrize("size", SIZES)
def test_walk_page(browser: Browser, server: WalkServer, tmp_path: Path, size: str) -> None:
    width, height = SIZES[size]
    mobile = size != "desk"
    context = browser.new_context(
        viewport={"width": width, "height": height}, has_touch=mobile, is_mobile=mobile
    )
    visit = Visit(context.new_page()).open(f"{server.url}/walk/room")
    page = visit.page
    page.get_by_role("heading", name="The painted room").wait_for()
    figures = page.get_by_role("button", name="Figures")
    if figures.get_attribute("aria-pressed") != "true":
        figures.click()
    panel = page.get_by_label("Figures", exact=True).last
    panel.get_by_text("Near triangles").wait_for()
    picture = keep(page, tmp_path, f"walk-{size}")
    # The room's walls are colourful, and the whole window shows them.
    assert picture.shape[:2] == (height, width)
    assert (picture[height // 2 :].max(axis=(0, 1)) > 120).all()
    page.get_by_role("button", name="Help").click()
    dialog = page.get_by_role("dialog")
    box = dialog.bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= width
    assert box["y"] >= 0
    assert box["y"] + box["height"] <= height
    keep(page, tmp_path, f"help-{size}")
    page.get_by_role("button", name="Walk on").click()
    dialog.wait_for(state="detached")
    # Nothing may scroll sideways.
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()
    assert visit.errors == []


def test_figures_are_those_of_the_cell(visit: Visit, server: WalkServer) -> None:
    visit.page.set_viewport_size({"width": 1000, "height": 600})
    visit.open(f"{server.url}/walk/room")
    panel = visit.page.get_by_label("Figures", exact=True).last
    panel.get_by_text("Near triangles").wait_for()
    # In one go, since rows come and go while something loads.
    rows = panel.evaluate(
        "panel => Object.fromEntries([...panel.querySelectorAll('dl > div')]"
        ".map(row => [...row.children].map(cell => cell.textContent)))"
    )
    stats = visit.call("return farfield.stats")
    assert rows["Cell"] == "0 · 0 · 0"
    assert rows["Quads"] == str(stats["quads"])
    assert rows["Near triangles"] == str(stats["nearTriangles"]) == "84"
    assert stats["drawCalls"]["far"] in (1, 2)


def test_waiting_and_failing(browser: Browser, server: WalkServer, tmp_path: Path) -> None:
    context = browser.new_context(viewport={"width": 900, "height": 560})
    page = context.new_page()
    server.missing = {"/cells/"}
    page.goto(f"{server.url}/walk/room")
    page.get_by_text("This part is still being baked.").first.wait_for()
    keep(page, tmp_path, "waiting")
    page.goto(f"{server.url}/walk/nowhere")
    page.get_by_role("alert").wait_for()
    keep(page, tmp_path, "no-walk")
    context.close()


def test_front_page(browser: Browser, server: WalkServer, tmp_path: Path) -> None:
    context = browser.new_context(viewport={"width": 900, "height": 560})
    page = context.new_page()
    page.goto(f"{server.url}/")
    page.get_by_text("nothing to walk through yet").wait_for()
    keep(page, tmp_path, "front-empty")
    bakes = (
        '{"bakes": [{"id": "b1", "name": "Lake city", "scene": "s1",'
        ' "cells": {"done": 3, "total": 12}}], "next": null}'
    )
    page.route("**/api/v1/bakes?*", lambda route: route.fulfill(status=200, body=bakes))
    page.reload()
    link = page.get_by_role("link", name="Lake city")
    assert link.get_attribute("href") == "walk/b1"
    assert "3 of 12 cells" in link.inner_text()
    keep(page, tmp_path, "front")
    context.close()
