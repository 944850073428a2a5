"""The client and the commands that use it, against a real server with stand-in workers."""

from __future__ import annotations

import json
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from farfield.__main__ import main
from farfield.client import Client, ServerError
from farfield.server import Server
from farfield_core.errors import BadInputError, NotFoundError, SceneRefusedError

from tests.integration.breaking import BadLine
from tests.integration.serving import app_over, row


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    listening = Server("127.0.0.1", 0)
    with listening.beside(app_over(tmp_path / "store", c1_0_0="error")):
        yield listening.address


def model(tmp_path: Path, data: bytes = b"a model", name: str = "town.glb") -> Path:
    path = tmp_path / name
    path.write_bytes(data)
    return path


def test_from_a_file_to_a_bake(server: str, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    with Client(server) as client:
        scene = client.upload(model(tmp_path), lambda sent, total: told.append((sent, total)))
        assert told[-1] == (7, 7)
        assert client.wait_scene(scene).name == "town"
        plan = client.plan(scene, row(2), resolution=64)
        assert plan.cells == 2
        bake = client.bake(scene, row(2), resolution=64, layers=4)
        states = list(client.watch(bake))
        assert states[-1].state == "failed"
        assert [f.cell for f in states[-1].failures] == ["1_0_0"]
        assert [found.id for found in client.bakes()] == [bake]
        assert list(client.bakes(state="done")) == []
        assert client.control(bake, "retry").id == bake


def test_errors_are_the_servers_sentences(server: str, tmp_path: Path) -> None:
    with Client(server) as client:
        with pytest.raises(NotFoundError, match="no scene"):
            client.scene("none")
        with pytest.raises(BadInputError, match="cannot be read as a model"):
            client.upload(model(tmp_path, name="notes.txt"))
        with pytest.raises(SceneRefusedError, match="no triangles"):
            client.wait_scene(client.upload(model(tmp_path, b"refuse")))
        with pytest.raises(BadInputError, match="cannot be read"):
            client.upload(tmp_path / "missing.glb")
    with Client("http://127.0.0.1:9") as client, pytest.raises(ServerError, match="reached"):
        client.scene("none")
    with pytest.raises(BadInputError, match="no server"):
        Client("localhost")


def test_an_upload_goes_on_after_breaks(server: str, tmp_path: Path) -> None:
    data = bytes(range(256)) * 40_000
    line = BadLine(int(server.rsplit(":", 1)[1]), [1_000_000, 4_000_000, 9_000_000])
    with Client(f"http://127.0.0.1:{line.port}") as client:
        scene = client.upload(model(tmp_path, data))
    line.close()
    assert line.cuts == 3
    kept = tmp_path / "store/scenes" / scene / "source/town.glb"
    assert kept.read_bytes() == data


def test_the_commands(server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--server", server, "--json"]
    assert main(["upload", str(model(tmp_path)), *arguments]) == 0
    answer = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert answer["triangles"] == 2
    with Client(server) as client:
        bake = client.bake(answer["scene"], row(2), resolution=64, layers=4)
    assert main(["watch", bake, *arguments]) == 6
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["state"] == "failed"
    assert main(["bakes", *arguments]) == 0
    assert [b["id"] for b in json.loads(capsys.readouterr().out)["bakes"]] == [bake]
    assert main(["watch", "none", *arguments]) == 4
    assert "no bake" in capsys.readouterr().err


def test_keys_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = ["--store", str(tmp_path / "store")]
    assert main(["keys", "new", "box", "--scope", "read", *store]) == 0
    told = capsys.readouterr()
    assert told.out.startswith("farfield_")
    identity = told.err.split()[0]
    assert main(["keys", "list", *store]) == 0
    listed = capsys.readouterr().out
    assert identity in listed
    assert told.out.strip() not in listed
    assert main(["keys", "revoke", identity, *store]) == 0
    assert main(["keys", "revoke", identity, *store]) == 4


def test_threads_may_share_a_client(server: str, tmp_path: Path) -> None:
    with Client(server) as client:
        scene = client.upload(model(tmp_path))
        found: list[str] = []
        threads = [
            threading.Thread(target=lambda: found.append(client.scene(scene).id)) for _ in range(8)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert found == [scene] * 8


def test_names_in_a_zip_are_sent_whole(server: str, tmp_path: Path) -> None:
    packed = tmp_path / "town.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("town.glb", b"a model")
    with Client(server) as client:
        assert client.wait_scene(client.upload(packed)).name == "town"
