"""Stands in for `farfield_worker prepare`: any source becomes a square of ground, 200 m wide.

A source that begins with "refuse" is refused, "crash" kills the process, "slow" takes 2 s.
"""

import json
import os
import sys
import time
from pathlib import Path

import numpy as np
from farfield_core.scene import Batch, Block, Bounds, Part, SceneInfo


def option(name: str) -> str:
    return sys.argv[sys.argv.index(f"--{name}") + 1]


def main() -> None:
    source = Path(option("source")).read_bytes()
    if source.startswith(b"crash"):
        os.kill(os.getpid(), 11)
    if source.startswith(b"slow"):
        time.sleep(2)
    if source.startswith(b"refuse"):
        print(json.dumps({"ok": False, "error": "The model has no triangles."}))
        return
    out = Path(option("out"))
    out.mkdir(parents=True)
    corners = np.array([[-100, 0, -100], [100, 0, -100], [100, 0, 100], [-100, 0, 100]])
    np.save(out / "positions.npy", corners.astype(np.float32))
    np.save(out / "normals.npy", np.tile(np.array([0, 127, 0, 0], np.int8), (4, 1)))
    np.save(out / "uvs.npy", np.zeros((4, 2), np.float32))
    np.save(out / "colors.npy", np.full((4, 4), 65535, np.uint16))
    np.save(out / "triangles.npy", np.array([[0, 2, 1], [0, 3, 2]], np.uint32))
    block = Block(
        low=(-100.0, 0.0, -100.0),
        high=(100.0, 0.0, 100.0),
        first_vertex=0,
        vertices=4,
        parts=(Part(batch=0, first_triangle=0, triangles=2),),
    )
    info = SceneInfo(
        id=option("id"),
        name=option("name"),
        bounds=Bounds(min=(-100.0, 0.0, -100.0), max=(100.0, 0.0, 100.0)),
        origin=(0.0, 0.0, 0.0),
        triangles=2,
        vertices=4,
        textures=(),
        batches=(Batch(),),
        blocks=(block,),
        notes=("One line primitive was left out.",),
    )
    (out / "scene.json").write_text(info.model_dump_json(), encoding="utf-8")
    print(json.dumps({"ok": True}))


if __name__ == "__main__":
    main()
