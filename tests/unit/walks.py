"""Small scenes and bakes for tests."""

from farfield_core.bake import create_bake
from farfield_core.corridor import parse_corridor
from farfield_core.scene import Bounds, SceneInfo
from farfield_core.settings import BakeSettings
from farfield_core.store import Store
from farfield_core.walk import Walk


def scene_info(name: str = "a town", identity: str = "5ce0e0000000c0de") -> SceneInfo:
    """A scene of which only scene.json exists."""
    return SceneInfo(
        id=identity,
        name=name,
        bounds=Bounds(min=(-100.0, 0.0, -100.0), max=(100.0, 30.0, 100.0)),
        origin=(0.0, 0.0, 0.0),
        triangles=1000,
        vertices=500,
        textures=(),
        batches=(),
        blocks=(),
    )


def row_of_cells(store: Store, cells: int = 4) -> Walk:
    """A bake of cells 0_0_0, 1_0_0, ... of 10 m."""
    corridor = parse_corridor({"box": {"min": [0, 0, 0], "max": [10 * cells, 10, 10]}})
    return create_bake(store, scene_info(), corridor, BakeSettings(resolution=64, layers=4))
