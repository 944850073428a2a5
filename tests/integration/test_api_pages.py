"""The built pages and their addresses."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from tests.integration.serving import app_over, problem


@pytest.fixture
def dist(tmp_path: Path) -> Path:
    dist = tmp_path / "dist"
    (dist / "assets").mkdir(parents=True)
    (dist / "walk").mkdir()
    (dist / "index.html").write_text("<title>front</title>", encoding="utf-8")
    (dist / "walk/index.html").write_text("<title>walk</title>", encoding="utf-8")
    (dist / "assets/page-3f1c9a52.js").write_text("let x = 1;", encoding="utf-8")
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    return dist


@pytest.fixture
def client(tmp_path: Path, dist: Path) -> Iterator[TestClient]:
    with TestClient(app_over(tmp_path / "store", web=dist)) as client:
        yield client


@pytest.mark.parametrize(
    ("address", "title"),
    [
        ("/", "front"),
        ("/index.html", "front"),
        ("/scenes/abc", "front"),
        ("/walk/", "walk"),
        ("/walk/c4d07e9a1b5f3286", "walk"),
        ("/walk/c4d07e9a1b5f3286?eye=1,2,3", "walk"),
    ],
)
def test_addresses_inside_pages(client: TestClient, address: str, title: str) -> None:
    answer = client.get(address)
    assert answer.status_code == 200
    assert answer.text == f"<title>{title}</title>"
    assert answer.headers["cache-control"] == "no-cache"
    assert answer.headers["content-type"].startswith("text/html")


def test_hashed_assets_are_kept_for_ever(client: TestClient) -> None:
    answer = client.get("/assets/page-3f1c9a52.js")
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert answer.headers["content-type"].startswith("text/javascript")


def test_an_asset_that_is_not_there(client: TestClient) -> None:
    problem(client.get("/assets/gone.js"), 404)


@pytest.mark.parametrize("address", ["/../secret.txt", "/..%2fsecret.txt", "/%2e%2e/secret.txt"])
def test_nothing_outside_the_pages_is_served(client: TestClient, address: str) -> None:
    assert "secret" not in client.get(address).text.replace("secret.txt", "")


def test_the_api_keeps_its_own_addresses(client: TestClient) -> None:
    problem(client.get("/api/v1/nothing"), 404)
    answer = client.delete("/api/v1/health")
    problem(answer, 405)
    assert answer.headers["allow"] == "GET"


@pytest.mark.parametrize("address", ["/", "/walk/c4d07e9a1b5f3286"])
def test_a_server_without_pages_says_how_to_get_them(tmp_path: Path, address: str) -> None:
    with TestClient(app_over(tmp_path / "store")) as client:
        answer = client.get(address)
    assert answer.status_code == 503
    assert "make setup" in answer.text
    assert answer.headers["cache-control"] == "no-store"
