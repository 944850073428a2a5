"""The whole farm as it is run: the API, `farfield worker`, Redis and S3, baking real cells."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from fastapi.testclient import TestClient

from tests.integration.servers import BUCKET, RedisServer, running, s3_environment, s3_server
from tests.integration.serving import API, row, until

CELLS = 3


def towers() -> bytes:
    """A PLY file of upright squares around the first cells of a row."""
    vertices: list[str] = []
    faces: list[str] = []
    for n in range(36):
        x, z = (n % 6 - 2.5) * 90 + 15, (n // 6 - 2.5) * 90 + 5
        at = len(vertices)
        vertices += [f"{x + d} {y} {z + d} 200 {7 * n} 90" for d in (-15, 15) for y in (0, 40)]
        faces += [f"3 {at} {at + 1} {at + 3}", f"3 {at} {at + 3} {at + 2}"]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"property uchar {color}" for color in ("red", "green", "blue")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    return "\n".join([*header, "end_header", *vertices, *faces, ""]).encode()


def test_a_walk_is_baked_by_a_farm_over_s3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "redis").mkdir()
    redis, s3 = RedisServer(tmp_path / "redis"), s3_server(tmp_path / "s3")
    store = f"s3://{BUCKET}/store"
    with running(redis), running(s3):
        for name, value in s3_environment(s3.endpoint).items():
            monkeypatch.setenv(name, value)
        monkeypatch.setenv("FARFIELD_CACHE", str(tmp_path / "cache"))
        command = [sys.executable, "-m", "farfield", "worker", "--jobs", "1"]
        log = tmp_path / "worker.log"
        with log.open("wb") as out:
            worker = subprocess.Popen(
                [*command, "--store", store, "--broker", redis.url],
                stdout=out,
                stderr=out,
                start_new_session=True,
            )
        app = create_app(ApiSettings(store=store, broker=redis.url, web=tmp_path))
        try:
            with TestClient(app, base_url=f"http://test{API}/") as client:
                bake_and_look(client)
            assert b"Cells are drawn by " in log.read_bytes()
            assert list((tmp_path / "cache").glob("*/scene.json"))
            worker.send_signal(signal.SIGTERM)
            assert worker.wait(timeout=60) == 0
        finally:
            if worker.poll() is None:
                os.killpg(worker.pid, signal.SIGKILL)
                worker.wait()


def bake_and_look(client: TestClient) -> None:
    scene = client.post("scenes", files={"file": ("towers.ply", towers())}).json()["id"]
    until(lambda: client.get(f"scenes/{scene}").json()["state"] != "preparing")
    assert client.get(f"scenes/{scene}").json()["state"] == "ready"
    settings = {"resolution": 64, "layers": 8}
    body = {"scene": scene, "corridor": row(CELLS), "settings": settings}
    bake = client.post("bakes", json=body).json()["id"]
    until(lambda: client.get(f"bakes/{bake}").json()["state"] not in ("queued", "running"))
    state = client.get(f"bakes/{bake}").json()
    assert state["state"] == "done", state
    assert state["cells"] == {"total": CELLS, "done": CELLS, "failed": 0}
    cell = client.get(f"walks/{bake}/cells/1_0_0.json").json()
    assert cell["figures"]["quads"] > 0
    for page in cell["atlases"]:
        assert client.get(f"walks/{bake}/atlases/{page}").content.startswith(b"\x89PNG")
    until(lambda: client.get("farm").json()["workers"][0]["done"] == CELLS)  # told once a second
    (slot,) = client.get("farm").json()["workers"]
    assert client.get("workers").json()["workers"][0]["worker"] == slot["worker"]
    assert slot["renderer"]
    assert (slot["tried"], slot["aside"]) == (0, None)
    assert client.get("farm").json()["wanted"] == {"cpu": 0, "gpu": 0}
