"""Which way up a model is read, and what it looks like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from farfield_core.scene import SceneInfo, Suspicion, open_scene
from farfield_worker.prepare import prepare
from farfield_worker.prepare.orientation import upright_matrix


def room(up: str, scale: float) -> trimesh.Trimesh:
    """A wide floor and a few walls, `up` pointing up, in units of 1 / scale metres."""
    parts = [trimesh.creation.box((30, 0.2, 20))]
    for x in (-10, 0, 10):
        wall = trimesh.creation.box((0.2, 3, 6))
        wall.apply_translation((x, 1.5, 0))
        parts.append(wall)
    mesh = trimesh.util.concatenate(parts)
    if up == "z":
        mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    mesh.apply_scale(1 / scale)
    return mesh


def read(tmp_path: Path, mesh: trimesh.Trimesh, suffix: str = ".stl", **how: object) -> SceneInfo:
    path = tmp_path / f"room{suffix}"
    mesh.export(path)
    return prepare(path, tmp_path / "out", "a" * 16, "room", pictures=False, **how)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("up", "scale", "suspected"),
    [
        ("y", 1.0, None),
        ("z", 1.0, Suspicion(up="z", scale=1.0)),
        ("y", 0.001, Suspicion(up="y", scale=0.001)),
        ("z", 0.001, Suspicion(up="z", scale=0.001)),
    ],
)
def test_guesses(tmp_path: Path, up: str, scale: float, suspected: Suspicion | None) -> None:
    assert read(tmp_path, room(up, scale)).suspected == suspected


def test_gltf_says_what_is_up(tmp_path: Path) -> None:
    assert read(tmp_path, room("z", 1.0), ".glb").suspected is None


def test_a_guess_that_is_taken_is_right(tmp_path: Path) -> None:
    plain = read(tmp_path, room("y", 1.0))
    turned = read(tmp_path, room("z", 0.001), up="z", scale=0.001)
    assert turned.suspected is None
    assert np.allclose(turned.bounds.min, plain.bounds.min, atol=1e-4)
    assert np.allclose(turned.bounds.max, plain.bounds.max, atol=1e-4)
    scene = open_scene(tmp_path / "out")
    # still right-handed: outward normals of the floor's top point up
    top = scene.positions[:, 1] + scene.origin[1] > 2.9
    assert (scene.normals[top][:, 1] >= 0).all()


def test_the_matrix() -> None:
    turn = upright_matrix("z", 2.0)
    assert np.allclose(turn @ (0, 0, 1, 1), (0, 2, 0, 1))
    assert np.allclose(turn @ (0, 1, 0, 1), (0, 0, -2, 1))
    assert np.linalg.det(turn[:3, :3]) == pytest.approx(8.0)
    assert np.array_equal(upright_matrix("y", 1.0), np.eye(4))
