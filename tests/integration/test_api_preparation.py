"""Uploads through the real preparation: what is read, and what is refused in a sentence."""

from pathlib import Path

import pytest
import trimesh
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from fastapi.testclient import TestClient

from tests.integration.serving import API, until, upload


def described(client: TestClient, content: bytes, name: str) -> dict[str, object]:
    scene = upload(client, content, name)
    body: dict[str, object] = until(
        lambda: (b := client.get(f"scenes/{scene}").json())["state"] != "preparing" and b
    )
    return body


@pytest.fixture
def box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(2.0, 4.0, 6.0))


def test_models_become_scenes(tmp_path: Path, box: trimesh.Trimesh) -> None:
    app = create_app(ApiSettings(store=str(tmp_path / "store"), web=tmp_path))
    with TestClient(app, base_url=f"http://test{API}/") as client:
        for suffix in ("glb", "ply", "stl"):
            body = described(client, box.export(file_type=suffix), f"box.{suffix}")
            assert (body["state"], body["name"], body["triangles"]) == ("ready", "box", 12)
            assert body["bounds"] == {"min": [-1.0, -2.0, -3.0], "max": [1.0, 2.0, 3.0]}


def test_a_broken_model_is_refused_and_nothing_prepared_is_left(
    tmp_path: Path, box: trimesh.Trimesh
) -> None:
    app = create_app(ApiSettings(store=str(tmp_path / "store"), web=tmp_path))
    whole = box.export(file_type="glb")
    with TestClient(app, base_url=f"http://test{API}/") as client:
        for broken in (whole[: len(whole) // 2], b"", b"glTF" + whole[:100]):
            body = described(client, broken, "broken.glb")
            assert body["state"] == "refused"
            assert str(body["reason"]).endswith(".")
    assert list((tmp_path / "store").rglob("prepared")) == []
    assert list((tmp_path / "store").rglob(".preparing*")) == []
