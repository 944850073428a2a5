"""Who may do what: keys, scopes, rotation, rates, quotas, other origins; and saying it twice."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from farfield_api.auth import Buckets, needed_scope
from farfield_api.keys import Keys, hash_of
from farfield_api.settings import ApiSettings
from farfield_core.errors import BadInputError
from farfield_core.store import Store
from fastapi.testclient import TestClient

from tests.integration.serving import API, app_over, problem, ready_scene, row, start_bake, until

ADMIN = "farfield_first-key-of-all"


@contextmanager
def locked(folder: Path, **settings: Any) -> Iterator[TestClient]:
    app = app_over(
        folder, settings={"host": "0.0.0.0", "api_keys": f"root:admin:{hash_of(ADMIN)}", **settings}
    )
    with TestClient(app, base_url=f"http://test{API}/") as client:
        yield client


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def new_key(client: TestClient, scope: str) -> dict[str, Any]:
    answer = client.post("keys", json={"name": f"a-{scope}", "scope": scope}, headers=bearer(ADMIN))
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


@pytest.mark.parametrize(
    ("host", "auth", "asked"),
    [
        ("127.0.0.1", "auto", False),
        ("localhost", "auto", False),
        ("::1", "auto", False),
        ("0.0.0.0", "auto", True),
        ("192.168.1.5", "auto", True),
        ("127.0.0.1", "on", True),
        ("0.0.0.0", "off", False),
    ],
)
def test_when_keys_are_asked_for(host: str, auth: Any, asked: bool) -> None:
    assert ApiSettings(host=host, auth=auth).needs_keys is asked


def test_without_a_key_only_a_link_opens(tmp_path: Path) -> None:
    with locked(tmp_path / "store") as client:
        assert client.get("health").status_code == 200
        for path in ("scenes", "bakes", "uploads/" + 32 * "0", "scenes/a/map.png"):
            answer = client.get(path)
            assert "Bearer" in problem(answer, 401)
            assert answer.headers["www-authenticate"] == "Bearer"
        problem(client.post("bakes", json={}), 401)
        problem(client.get("http://test/metrics"), 401)
        client.headers.update(bearer(ADMIN))
        bake = start_bake(client, 2)
        until(lambda: client.get(f"bakes/{bake}").json()["state"] == "done")
        del client.headers["Authorization"]
        # what a share link needs
        assert client.get(f"walks/{bake}/walk.json").status_code == 200
        assert client.get(f"walks/{bake}/cells/0_0_0.json").status_code == 200
        assert client.get(f"bakes/{bake}").status_code == 200
        assert client.post(f"bakes/{bake}/focus", json={"cell": [0, 0, 0]}).status_code == 204
        problem(client.post(f"bakes/{bake}/cancel"), 401)


def test_scopes(tmp_path: Path) -> None:
    with locked(tmp_path / "store") as client:
        read, write = new_key(client, "read")["key"], new_key(client, "write")["key"]
        assert client.get("scenes", headers=bearer(read)).status_code == 200
        files = {"file": ("town.glb", b"a model")}
        sentence = problem(client.post("scenes", files=files, headers=bearer(read)), 403)
        assert "scope read" in sentence
        assert client.post("scenes", files=files, headers=bearer(write)).status_code == 201
        problem(client.get("keys", headers=bearer(write)), 403)
        assert client.get("keys", headers=bearer(ADMIN)).status_code == 200
        problem(client.get("scenes", headers=bearer("farfield_wrong")), 401)
    assert needed_scope("PATCH", "/uploads/x") == "write"
    assert needed_scope("DELETE", "/bakes/x") == "write"


def test_only_hashes_are_kept(tmp_path: Path) -> None:
    with locked(tmp_path / "store") as client:
        made = new_key(client, "read")
        listed = client.get("keys", headers=bearer(ADMIN)).text
    assert made["key"] not in listed
    for path in (tmp_path / "store").rglob("*"):
        if path.is_file():
            assert made["key"].encode() not in path.read_bytes()


def test_rotation_and_revocation(tmp_path: Path) -> None:
    with locked(tmp_path / "store") as client:
        old = new_key(client, "read")
        body = {"overlap_hours": 1}
        new = client.post(f"keys/{old['id']}/rotate", json=body, headers=bearer(ADMIN)).json()
        for key in (old, new):
            assert client.get("scenes", headers=bearer(key["key"])).status_code == 200
        last = client.post(
            f"keys/{new['id']}/rotate", json={"overlap_hours": 0}, headers=bearer(ADMIN)
        ).json()
        problem(client.get("scenes", headers=bearer(new["key"])), 401)
        assert client.delete(f"keys/{last['id']}", headers=bearer(ADMIN)).status_code == 204
        problem(client.get("scenes", headers=bearer(last["key"])), 401)
        problem(client.delete(f"keys/{last['id']}", headers=bearer(ADMIN)), 404)


def test_pages_use_a_cookie(tmp_path: Path) -> None:
    with locked(tmp_path / "store") as client:
        problem(client.post("session", json={"key": "farfield_wrong"}), 401)
        answer = client.post("session", json={"key": ADMIN})
        assert answer.status_code == 204
        cookie = answer.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        assert client.get("scenes").status_code == 200
        client.delete("session")
        problem(client.get("scenes"), 401)


def test_a_first_key_is_made_where_there_is_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with locked(tmp_path / "store", api_keys="") as client:
        secret = caplog.messages[-1].rsplit(" ", 1)[1]
        assert client.get("keys", headers=bearer(secret)).status_code == 200
    assert len(Keys(Store.open(tmp_path / "store")).list()) == 1


@pytest.mark.parametrize("text", ["x", "a:read:zz", "a:all:" + 64 * "0", ":read:" + 64 * "0"])
def test_bad_keys_in_the_settings(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInputError, match="FARFIELD_API_KEYS"):
        Keys(Store.open(tmp_path), text)


def test_a_key_that_asks_too_often_waits(tmp_path: Path) -> None:
    with locked(tmp_path / "store", rate=3) as client:
        client.headers.update(bearer(ADMIN))
        answers = [client.post("session/none", json={}).status_code for _ in range(5)]
        assert answers[:3] == [404, 404, 404]
        assert answers[3:] == [429, 429]
        answer = client.post("session/none")
        assert int(answer.headers["retry-after"]) > 0
        assert client.get("scenes").status_code == 200
    buckets = Buckets(60)
    assert [buckets.wait("a") for _ in range(60)] == [0.0] * 60
    assert 0 < buckets.wait("a") <= 1
    assert buckets.wait("b") == 0.0
    assert buckets.wait("a", "PATCH") == 0.0


def test_quotas(tmp_path: Path) -> None:
    with locked(tmp_path / "store", quota_cells=3, quota_bytes=10) as client:
        client.headers.update(bearer(ADMIN))
        body = {"scene": ready_scene(client), "corridor": row(4)}
        assert "4 cells" in problem(client.post("bakes", json=body), 403)
        tus = {"Tus-Resumable": "1.0.0", "Upload-Metadata": "filename YS5nbGI="}
        sizes = [client.post("uploads", headers=tus | {"Upload-Length": n}) for n in ("6", "6")]
        assert sizes[0].status_code == 201
        assert "10" in problem(sizes[1], 507)


def test_other_origins(tmp_path: Path) -> None:
    settings = {"cors": "https://good.example, https://too.example"}
    with TestClient(
        app_over(tmp_path / "store", settings=settings), base_url=f"http://test{API}/"
    ) as client:
        good = client.get("scenes", headers={"Origin": "https://good.example"})
        assert good.headers["access-control-allow-origin"] == "https://good.example"
        assert "Upload-Offset" in good.headers["access-control-expose-headers"]
        bad = client.get("scenes", headers={"Origin": "https://bad.example"})
        assert "access-control-allow-origin" not in bad.headers
        asked = {"Access-Control-Request-Method": "PATCH", "Origin": "https://good.example"}
        assert client.options("uploads", headers=asked).status_code == 200


def test_pages_of_other_sites_change_nothing(tmp_path: Path) -> None:
    settings = {"cors": "https://good.example"}
    with TestClient(
        app_over(tmp_path / "store", settings=settings), base_url=f"http://test{API}/"
    ) as client:
        form = {"file": ("town.glb", b"a model")}
        evil = {"Sec-Fetch-Site": "cross-site", "Origin": "https://evil.example"}
        assert "other sites" in problem(client.post("scenes", files=form, headers=evil), 403)
        assert client.get("scenes", headers=evil).status_code == 200
        for where in (
            {"Sec-Fetch-Site": "same-origin", "Origin": "http://test"},
            {"Sec-Fetch-Site": "cross-site", "Origin": "https://good.example"},
            {},
        ):
            assert client.post("scenes", files=form, headers=where).status_code == 201


def test_links_come_from_the_settings(tmp_path: Path) -> None:
    settings = {"base_url": "https://walks.example/far"}
    headers = {
        "Host": "evil.example",
        "Tus-Resumable": "1.0.0",
        "Upload-Length": "1",
        "Upload-Metadata": "filename YS5nbGI=",
    }
    with TestClient(app_over(tmp_path / "store", settings=settings)) as client:
        location = client.post(f"{API}/uploads", headers=headers).headers["location"]
    assert location.startswith("https://walks.example/far/api/v1/uploads/")


def test_the_same_request_twice(tmp_path: Path) -> None:
    with TestClient(app_over(tmp_path / "store"), base_url=f"http://test{API}/") as client:
        headers = {
            "Idempotency-Key": "one",
            "Tus-Resumable": "1.0.0",
            "Upload-Length": "5",
            "Upload-Metadata": "filename YS5nbGI=",
        }
        first = client.post("uploads", headers=headers)
        again = client.post("uploads", headers=headers)
        assert again.status_code == 201
        assert again.headers["location"] == first.headers["location"]
        assert again.headers["idempotency-replayed"] == "true"
        other = client.post("uploads", headers=headers | {"Upload-Length": "6"})
        assert "another request" in problem(other, 422)
        fresh = client.post("uploads", headers=headers | {"Idempotency-Key": "two"})
        assert fresh.headers["location"] != first.headers["location"]
        problem(client.post("bakes", json={}, headers={"Idempotency-Key": "x y"}), 422)
        # what failed may be asked again
        body = {"scene": "none", "corridor": row(1)}
        for _ in range(2):
            answer = client.post("bakes", json=body, headers={"Idempotency-Key": "three"})
            problem(answer, 404)
    # another server over the same store answers alike
    with TestClient(app_over(tmp_path / "store"), base_url=f"http://test{API}/") as client:
        again = client.post("uploads", headers=headers)
        assert again.headers["location"] == first.headers["location"]
