"""A walk among stones that repeat: height fields in place of polygons, in a real browser."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.browser.example import Example, Pixels, example, off
from tests.browser.server import WalkServer
from tests.unit.prepare.build import Gltf

__all__ = ["example"]

STONES = 12
DRAW = """
const { walk } = objects.hooks;
objects.stand.look([0, 1.5, 0], [1, 1.2, 0.3]);
do {
  objects.stand.draw(performance.now() / 1000);
  await new Promise((done) => setTimeout(done, 10));
} while (!(walk.settled && walk.idle) || walk.objects.stats.copies !== args[0]);
return { ...walk.objects.stats, triangles: objects.stand.renderer.info.render.triangles };
"""


@pytest.fixture(scope="module")
def stones(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with the walk: stones in a ring on a plane, one of them close by."""
    folder = tmp_path_factory.mktemp("stones")
    gltf = Gltf()
    for colour in ([0.7, 0.3, 0.2, 1], [0.3, 0.5, 0.3, 1]):
        gltf.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": colour}})
    ball = trimesh.creation.icosphere(subdivisions=4)
    waves = 1 + 0.15 * np.sin(4 * ball.vertices).sum(axis=1, keepdims=True)
    stone = gltf.mesh(
        {
            "attributes": {"POSITION": gltf.accessor((waves * ball.vertices).astype("f4"))},
            "indices": gltf.accessor(ball.faces.astype("u2").ravel()),
            "material": 0,
        }
    )
    rng = np.random.default_rng(5)
    for n in range(STONES):
        angle, far = 2 * np.pi * n / STONES, 4.0 if n == 0 else 18.0
        q = rng.normal(size=4)
        gltf.node(
            mesh=stone,
            translation=[far * np.cos(angle), 1.0, far * np.sin(angle)],
            rotation=(q / np.linalg.norm(q)).tolist(),
        )
    ground = gltf.mesh(gltf.quad(1))
    flat = [-(0.5**0.5), 0, 0, 0.5**0.5]
    gltf.node(mesh=ground, translation=[-50, 0, 50], rotation=flat, scale=[100, 100, 1])
    model = gltf.write(folder)
    corridor = {"path": {"points": [[0, 0.5, 0]], "width": 0.1, "height": 2}}
    (folder / "corridor.json").write_text(json.dumps(corridor), encoding="utf-8")
    command = [sys.executable, "-m", "farfield", "bake", str(model), "--json"]
    command += ["--corridor", str(folder / "corridor.json"), "--out", str(folder / "out")]
    command += ["--cell-size", "2", "--near", "40", "--resolution", "64"]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "out"


def test_stones_afar_are_height_fields_and_look_like_their_polygons(
    example: Example, server: WalkServer, stones: Path
) -> None:
    server.walks["stones"] = stones
    (manifest,) = stones.glob("bakes/*/walk.json")
    at = f"{server.url}/api/v1/walks/stones/bakes/{manifest.parent.name}/walk.json"

    def shown(near: str, copies: int) -> tuple[Pixels, dict[str, float]]:
        example.show(server, f"show=walk&near={near}&walk={at}")
        stats = example.call(DRAW, copies)
        return example.picture(), stats

    polygons, all_polygons = shown("never", 0)
    # the one close by stays polygons
    fields, some = shown("copies", STONES - 1)
    assert some["triangles"] < all_polygons["triangles"] / 2
    wrong = off(polygons, fields)
    example.call(
        """
        objects.hooks.walk.group.traverse((object) => {
          if (object.geometry?.isInstancedBufferGeometry) object.visible = false;
        });
        objects.stand.renderer.render(objects.stand.scene, objects.stand.camera);
        """
    )
    hidden = off(polygons, example.picture())
    assert hidden > 5e-3
    assert wrong < 0.1 * hidden
