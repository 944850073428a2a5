"""True impostors in a real browser: outline, depth and light against the mesh itself."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from farfield_worker.demo.asteroid import write_asteroid
from farfield_worker.objects.command import bake_object
from farfield_worker.objects.error import outline_distance, sphere

from tests.browser.example import Example, Pixels, example, off
from tests.browser.server import WalkServer

__all__ = ["example"]


@pytest.fixture(scope="module")
def stone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A baked asteroid beside its model."""
    folder = tmp_path_factory.mktemp("stone")
    write_asteroid(folder / "stone.glb", 3)
    bake_object(folder / "stone.glb", folder / "baked", 96)
    return folder


@pytest.fixture
def stones(example: Example, server: WalkServer, stone: Path) -> Callable[[str], Example]:
    """Opens the page of stones."""
    server.walks["stone"] = stone
    at = f"{server.url}/api/v1/walks/stone"

    def opened(query: str) -> Example:
        return example.show(
            server, f"show=stones&object={at}/baked/object.json&model={at}/stone.glb&{query}"
        )

    return opened


def both(example: Example, eye: list[float]) -> tuple[Pixels, Pixels]:
    """The picture of the mesh and that of the impostor."""
    found = []
    for kind in ("mesh", "impostor"):
        example.call(
            "objects.hooks.use(args[0]); objects.stand.look(args[1], [0, 0, 0]);"
            "objects.stand.draw(0)",
            kind,
            eye,
        )
        found.append(example.picture())
    return found[0], found[1]


def test_outline_and_colour_are_those_of_the_mesh(stones: Callable[[str], Example]) -> None:
    example = stones("count=1")
    distances, wrong = [], []
    # Far enough that a texel is a pixel: nearer, polygons are drawn.
    focal = 256 / 2 / np.tan(np.radians(30))
    away = focal * 2.6 / 96
    for direction in sphere(12):
        mesh, impostor = both(example, [float(x) for x in away * direction])
        seen = mesh.max(axis=-1) > 0
        assert 1000 < seen.sum() < 12000
        distances.append(outline_distance(seen, impostor.max(axis=-1) > 0))
        wrong.append(off(mesh, impostor) * seen.size / seen.sum())
    silhouette = float((np.concatenate(distances) > 1).mean())
    assert silhouette < 0.01
    assert np.mean(wrong) < 0.02, wrong
    # The outline seen from elsewhere is another.
    other, _ = both(example, [0, float(away), 0.01])
    assert (outline_distance(other.max(axis=-1) > 0, impostor.max(axis=-1) > 0) > 1).mean() > 0.1


def test_depth_lets_it_meet_other_geometry(stones: Callable[[str], Example]) -> None:
    example = stones("count=200&radius=2&from=8")
    mesh, impostor = both(example, [0, 0, 12])
    # Stones that pierce each other: the line along which they meet is a matter of depth alone.
    seen = (mesh.max(axis=-1) > 0).mean()
    assert seen > 0.05
    assert off(mesh, impostor) / seen < 0.06
    # Without depth the last one drawn would win.
    flat = example.call(
        """
        objects.hooks.impostors.material.depthTest = false;
        objects.stand.draw(0);
        """
    )
    assert flat is None
    assert off(mesh, example.picture()) / seen > 0.15


def test_a_stone_shadows_itself_where_the_sun_cannot_reach(
    stones: Callable[[str], Example],
) -> None:
    eyes = [[float(x) for x in 4 * direction] for direction in sphere(8)]
    example = stones("count=1")
    lit = [both(example, eye)[1].astype(int).sum(axis=-1) for eye in eyes]
    example = stones("count=1&shadow")
    dark = [both(example, eye)[1].astype(int).sum(axis=-1) for eye in eyes]
    change = np.stack(lit) - np.stack(dark)
    assert (change >= 0).all()
    shadowed = (change > 10)[np.stack(lit) > 0].mean()
    assert 0.002 < shadowed < 0.3


def test_glass_bends_light_and_what_is_translucent_lets_it_through(
    stones: Callable[[str], Example],
) -> None:
    _, glass = both(stones("count=1&kind=glass&sky"), [0, 0, 4])
    _, clear = both(stones("count=1&kind=translucent&sky"), [0, 0, 4])
    sky = np.array([0x9F, 0xC4, 0xE8])
    _, stone = both(stones("count=1&sky"), [0, 0, 4])
    on = np.abs(stone.astype(int) - sky).max(axis=-1) > 0
    # Glass covers the same pixels, and shows what is above upside down.
    shown = np.abs(glass.astype(int) - sky).max(axis=-1) > 0
    assert (shown != on).mean() < 0.005
    rows = np.flatnonzero(on.any(axis=1))
    middle = int(rows.mean())
    upper = glass[rows[0] : middle][on[rows[0] : middle]].astype(float).mean(axis=0)
    lower = glass[middle : rows[-1]][on[middle : rows[-1]]].astype(float).mean(axis=0)
    assert np.abs(upper - lower).max() > 5
    # What is translucent is between the sky and the stone, thin edges nearer to the sky.
    mixed = np.abs(clear.astype(int) - sky).max(axis=-1)
    assert 0 < mixed[on].mean() < np.abs(stone.astype(int) - sky).max(axis=-1)[on].mean()


def test_ten_thousand_are_drawn_in_one_call(stones: Callable[[str], Example]) -> None:
    example = stones("count=10000")
    example.call("objects.hooks.use('impostor'); objects.stand.drawOnPath(0)")
    info = example.call("return objects.stand.renderer.info.render")
    assert info["calls"] == 1
    assert info["triangles"] == 20000
    assert (example.picture().max(axis=-1) > 0).mean() > 0.2


@pytest.mark.parametrize(("page", "least"), [("ring&count=5000", 0.1), ("glass", 0.02)])
def test_the_example_pages_run(
    example: Example, server: WalkServer, page: str, least: float
) -> None:
    example.show(server, f"show={page}")
    example.call("objects.stand.drawOnPath(0)")
    first = example.picture().astype(int)
    assert len(np.unique(first.reshape(-1, 3) // 16, axis=0)) > 15
    example.call("objects.stand.drawOnPath(3)")
    assert (np.abs(example.picture() - first).max(axis=-1) > 8).mean() > least


def test_an_unknown_example_is_named(example: Example, server: WalkServer) -> None:
    example.page.goto(f"{server.url}/objects/index.html?show=nothing")
    assert "There is no example" in example.page.get_by_role("status").inner_text()
