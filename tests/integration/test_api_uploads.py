"""Resumable uploads: the protocol, the real client broken off again and again, constant memory."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from tests.integration.breaking import BadLine
from tests.integration.live import serving
from tests.integration.serving import client_over, problem, until

WEB = Path(__file__).parents[2] / "web"
SOAK = os.environ.get("FARFIELD_SOAK") == "1"
TUS = {"Tus-Resumable": "1.0.0"}
BYTES = {"Content-Type": "application/offset+octet-stream"}


def named(name: str) -> str:
    return f"filename {base64.b64encode(name.encode()).decode()}"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with client_over(tmp_path / "store") as client:
        client.headers.update(TUS)
        yield client


def begin(client: TestClient, length: int, name: str = "town.glb") -> str:
    headers = {"Upload-Length": str(length), "Upload-Metadata": named(name)}
    answer = client.post("uploads", headers=headers)
    assert answer.status_code == 201, answer.text
    assert answer.headers["tus-resumable"] == "1.0.0"
    assert "upload-expires" in answer.headers
    # never from the Host header
    assert answer.headers["location"].startswith("/api/v1/uploads/")
    return answer.headers["location"].rsplit("/", 1)[-1]


def send(client: TestClient, upload: str, offset: int, data: bytes, **more: str) -> Any:
    headers = (
        BYTES | {"Upload-Offset": str(offset)} | {k.replace("_", "-"): v for k, v in more.items()}
    )
    return client.patch(f"uploads/{upload}", headers=headers, content=data)


def offset(client: TestClient, upload: str) -> int:
    answer = client.head(f"uploads/{upload}")
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "no-store"
    return int(answer.headers["upload-offset"])


def scene_of(client: Any, upload: str) -> str:
    body = until(lambda: (b := client.get(f"uploads/{upload}").json())["state"] == "done" and b)
    return str(body["scene"])


def test_an_upload_in_parts_becomes_a_scene(client: TestClient, tmp_path: Path) -> None:
    upload = begin(client, 10)
    assert offset(client, upload) == 0
    assert send(client, upload, 0, b"slow ").headers["upload-offset"] == "5"
    assert client.get(f"uploads/{upload}").json()["state"] == "receiving"
    answer = send(client, upload, 5, b"model")
    assert answer.status_code == 204
    assert answer.headers["upload-offset"] == "10"
    scene = scene_of(client, upload)
    source = tmp_path / "store/scenes" / scene / "source"
    assert (source / "town.glb").read_bytes() == b"slow model"
    assert offset(client, upload) == 10
    # the same bytes in one request are the same scene
    again = client.post("scenes", files={"file": ("town.glb", b"slow model")})
    assert again.json()["id"] == scene


def test_options(client: TestClient) -> None:
    answer = client.options("uploads")
    assert answer.status_code == 204
    assert answer.headers["tus-version"] == "1.0.0"
    extensions = set(answer.headers["tus-extension"].split(","))
    assert extensions >= {"creation", "termination", "expiration", "checksum"}
    assert int(answer.headers["tus-max-size"]) == 20 * 1024**3


def test_the_body_may_come_with_the_beginning(client: TestClient) -> None:
    headers = BYTES | {"Upload-Length": "4", "Upload-Metadata": named("a.glb")}
    answer = client.post("uploads", headers=headers, content=b"abcd")
    assert answer.headers["upload-offset"] == "4"
    scene_of(client, answer.headers["location"].rsplit("/", 1)[-1])


def test_a_zip_is_unpacked(client: TestClient, tmp_path: Path) -> None:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("town/town.obj", "mtllib town.mtl\n")
        archive.writestr("town/town.mtl", "map_Kd wall.png\n")
        archive.writestr("town/wall.png", "a picture")
    upload = begin(client, len(data.getvalue()), "town.zip")
    send(client, upload, 0, data.getvalue())
    source = tmp_path / "store/scenes" / scene_of(client, upload) / "source"
    assert sorted(p.name for p in source.iterdir()) == ["town.mtl", "town.obj", "wall.png"]
    # cleared away after the upload is said to be done, so that no crash can lose it
    until(lambda: [p.suffix for p in (tmp_path / "store/uploads").iterdir()] == [".json"])


def test_a_refused_zip_says_why(client: TestClient) -> None:
    upload = begin(client, 9, "town.zip")
    send(client, upload, 0, b"not a zip")
    body = until(lambda: (b := client.get(f"uploads/{upload}").json())["state"] == "refused" and b)
    assert body["reason"] == "town.zip cannot be read: it is damaged or no zip."


def test_offsets_have_to_match(client: TestClient) -> None:
    upload = begin(client, 10)
    assert "at byte 0, not 3" in problem(send(client, upload, 3, b"x"), 409)
    send(client, upload, 0, b"abc")
    assert "at byte 3" in problem(send(client, upload, 0, b"abc"), 409)


def test_more_than_announced_is_refused(client: TestClient) -> None:
    upload = begin(client, 3)
    problem(send(client, upload, 0, b"abcd"), 413)
    assert offset(client, upload) == 0


@pytest.mark.parametrize("algorithm", ["sha1", "sha256", "md5"])
def test_checksums(client: TestClient, algorithm: str) -> None:
    upload = begin(client, 6)
    good = base64.b64encode(hashlib.new(algorithm, b"abc").digest()).decode()
    answer = send(client, upload, 0, b"abX", Upload_Checksum=f"{algorithm} {good}")
    assert answer.status_code == 460
    assert offset(client, upload) == 0
    answer = send(client, upload, 0, b"abc", Upload_Checksum=f"{algorithm} {good}")
    assert answer.status_code == 204
    assert offset(client, upload) == 3
    problem(send(client, upload, 3, b"def", Upload_Checksum="whirl AAAA"), 400)
    problem(send(client, upload, 3, b"def", Upload_Checksum=f"{algorithm} ???"), 400)


def test_an_upload_is_taken_back(client: TestClient, tmp_path: Path) -> None:
    upload = begin(client, 10)
    assert client.delete(f"uploads/{upload}").status_code == 204
    assert client.head(f"uploads/{upload}").status_code == 404
    assert list((tmp_path / "store/uploads").iterdir()) == []


def test_an_upload_that_does_not_go_on_is_gone(client: TestClient, tmp_path: Path) -> None:
    upload = begin(client, 10)
    for path in (tmp_path / "store/uploads").iterdir():
        os.utime(path, (1e9, 1e9))
    problem(client.get(f"uploads/{upload}"), 410)
    begin(client, 1)
    assert client.get(f"uploads/{upload}").status_code == 404


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Upload-Length": "-1"}, 422),
        ({"Upload-Length": str(2**60)}, 422),
        ({"Upload-Length": str(10**14)}, 413),
        ({"Upload-Length": "5", "Upload-Metadata": named("a.txt")}, 422),
        ({"Upload-Length": "5", "Upload-Metadata": "filename ???"}, 422),
        ({"Upload-Length": "5", "Tus-Resumable": "0.2.2"}, 412),
    ],
)
def test_bad_beginnings(
    client: TestClient, tmp_path: Path, headers: dict[str, str], status: int
) -> None:
    all_headers = {"Upload-Metadata": named("a.glb")} | headers
    problem(client.post("uploads", headers=all_headers), status)
    assert list((tmp_path / "store/uploads").iterdir()) == []


def test_uploads_go_on_after_a_restart(tmp_path: Path) -> None:
    with client_over(tmp_path / "store") as client:
        client.headers.update(TUS)
        upload = begin(client, 6)
        send(client, upload, 0, b"abc")
    with client_over(tmp_path / "store") as client:
        client.headers.update(TUS)
        assert offset(client, upload) == 3
        send(client, upload, 3, b"def")
        scene_of(client, upload)


def test_what_was_complete_is_taken_after_a_restart(tmp_path: Path) -> None:
    """As if the server had been killed between the last byte and the store."""
    with client_over(tmp_path / "store") as client:
        client.headers.update(TUS)
        upload = begin(client, 3)
    taking = tmp_path / f"store/uploads/{upload}.taking"
    taking.mkdir()
    (tmp_path / f"store/uploads/{upload}.part").unlink()
    (taking / "town.glb").write_bytes(b"abc")
    with client_over(tmp_path / "store") as client:
        scene_of(client, upload)


def test_the_real_client_broken_off_twenty_times(tmp_path: Path) -> None:
    """tus-js-client in Node against a real server, over a line that is reset at random bytes."""
    random = np.random.default_rng(20)
    size = 24 << 20
    model = tmp_path / "noise.stl"
    model.write_bytes(random.bytes(size))
    store = tmp_path / "store"
    with serving(store) as live, live.client() as client:
        line = BadLine(int(live.url.rsplit(":", 1)[1]), random.integers(1, size, 20).tolist())
        command = ["node", str(Path(__file__).with_name("tus_client.mjs"))]
        out = subprocess.run(
            [*command, f"http://127.0.0.1:{line.port}/api/v1/uploads", str(model), str(8 << 20)],
            env=os.environ | {"FARFIELD_TUS_FROM": str(WEB / "app/package.json")},
            check=False,
            capture_output=True,
            text=True,
            timeout=120,
        )
        line.close()
        assert out.returncode == 0, out.stderr
        said = json.loads(out.stdout.splitlines()[-1])
        assert line.cuts == 20
        assert said["resumed"] >= 19  # a line cut before there was an upload begins anew
        scene = scene_of(client, said["url"].rsplit("/", 1)[-1])
    kept = store / "scenes" / scene / "source" / "noise.stl"
    assert hashlib.sha256(kept.read_bytes()).digest() == hashlib.sha256(model.read_bytes()).digest()


def test_memory_does_not_grow_with_the_upload(tmp_path: Path) -> None:
    """A sparse file, 5 GB in the soak: the server stays under 200 MB."""
    before, peak = upload_sparse(tmp_path / "store", 5 * 10**9 if SOAK else 400 * 10**6)
    assert peak < 200 * 10**6, f"{peak} bytes, {before} before"


def upload_sparse(store: Path, size: int) -> tuple[int, int]:
    """Send so many zeros to a server of their own: its memory before, and the most, bytes."""
    sent = 0
    with serving(store) as live, live.client(headers=TUS) as client:
        headers = {"Upload-Length": str(size), "Upload-Metadata": named("sparse.stl")}
        location = live.url + client.post("uploads", headers=headers).headers["location"]
        before = live.memory()
        block = bytes(1 << 20)

        def part(count: int) -> Iterator[bytes]:
            while count > 0:
                yield block[:count]
                count -= len(block)

        while sent < size:
            length = min(128 << 20, size - sent)
            answer = client.patch(
                location, headers=BYTES | {"Upload-Offset": str(sent)}, content=part(length)
            )
            assert answer.status_code == 204, answer.text
            sent += length
        scene_of(client, location.rsplit("/", 1)[-1])
        return before, live.memory(peak=True)
