"""The compose file and the images, as far as they can be checked without a container engine."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from farfield_worker.farm.bakers import Limits

ROOT = Path(__file__).parents[2]
COMPOSE = ROOT / "docker-compose.yml"
GPU = ROOT / "docker-compose.gpu.yml"
DOCKERFILES = sorted((ROOT / "deploy/docker").glob("*.Dockerfile"))


def validate(path: Path) -> int:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    return subprocess.run([*command, path], check=False, capture_output=True).returncode


def instructions(dockerfile: Path) -> list[tuple[str, str]]:
    """(instruction, arguments) pairs, comments dropped and continued lines joined."""
    text = re.sub(r"^\s*#.*\n", "", dockerfile.read_text(encoding="utf-8"), flags=re.MULTILINE)
    lines = text.replace("\\\n", " ").splitlines()
    return [(line.split()[0], line.split(maxsplit=1)[1]) for line in lines if line.strip()]


def load(path: Path) -> dict[str, Any]:
    from ruamel.yaml import YAML  # check-jsonschema's own reader

    loaded: dict[str, Any] = YAML(typ="safe").load(path)
    return loaded


def compose() -> dict[str, Any]:
    return load(COMPOSE)


def test_compose_file_is_accepted() -> None:
    assert validate(COMPOSE) == 0


def test_a_wrong_compose_file_is_not_accepted(tmp_path: Path) -> None:
    wrong = tmp_path / "docker-compose.yml"
    text = COMPOSE.read_text(encoding="utf-8")
    wrong.write_text(text.replace("restart:", "restrat:"), encoding="utf-8")
    assert validate(wrong) == 1


def test_compose_builds_from_dockerfiles_that_exist() -> None:
    services = compose()["services"]
    assert set(services) == {"redis", "s3", "api", "web", "worker"}
    for name in ("s3", "api", "worker"):
        build = services[name]["build"]
        assert (ROOT / build["context"] / build["dockerfile"]).is_file()


def test_api_and_workers_share_store_and_broker() -> None:
    services = compose()["services"]
    shared = ("FARFIELD_STORE", "FARFIELD_BROKER", "AWS_ENDPOINT_URL", "AWS_SECRET_ACCESS_KEY")
    api, worker = services["api"]["environment"], services["worker"]["environment"]
    assert [api[name] for name in shared] == [worker[name] for name in shared]
    assert api["FARFIELD_BROKER"].startswith("redis://redis:")
    bucket = api["FARFIELD_STORE"].removeprefix("s3://").split("/")[0]
    assert services["s3"]["volumes"] == [f"store:/data/{bucket}"]
    assert services["s3"]["environment"]["ROOT_SECRET_KEY"] == api["AWS_SECRET_ACCESS_KEY"]


def test_a_worker_is_given_the_time_that_a_cell_may_take() -> None:
    grace = compose()["services"]["worker"]["stop_grace_period"]
    assert 60 * int(grace.removesuffix("m")) > Limits().seconds


def test_the_gpu_file_fits_the_compose_file() -> None:
    assert validate(GPU) == 0
    changed = load(GPU)["services"]
    assert set(changed) < set(compose()["services"])
    assert {s["environment"]["FARFIELD_DEVICE"] for s in changed.values()} == {"gpu"}


def test_compose_publishes_on_loopback_only() -> None:
    ports = [
        port for service in compose()["services"].values() for port in service.get("ports", [])
    ]
    assert ports
    assert all(port.startswith("127.0.0.1:") for port in ports)


@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda path: path.name)
def test_images(dockerfile: Path) -> None:
    steps = instructions(dockerfile)
    stages = {args.split()[2] for name, args in steps if name == "FROM" and " AS " in args}
    for name, args in steps:
        if name != "COPY":
            continue
        words = args.split()
        if words[0].startswith("--from="):
            assert words[0].removeprefix("--from=") in stages
        else:
            assert [w for w in words[:-1] if not (ROOT / w).exists()] == []
    last = max(i for i, (name, _) in enumerate(steps) if name == "FROM")
    run_time = steps[last:]
    assert run_time[0] == ("FROM", "python:3.11-slim")
    assert ("USER", "farfield") in run_time
    commands = [json.loads(args) for name, args in run_time if name == "CMD"]
    assert len(commands) == 1
    assert any(name == "HEALTHCHECK" for name, _ in run_time)


def test_what_images_copy_is_not_ignored() -> None:
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    kept = {line[1:] for line in lines if line.startswith("!")}
    for dockerfile in DOCKERFILES:
        for name, args in instructions(dockerfile):
            if name == "COPY" and not args.startswith("--from="):
                for source in args.split()[:-1]:
                    clean = source.rstrip("/")
                    assert any(clean == k or clean.startswith(k + "/") for k in kept), source


def test_only_the_worker_knows_gl() -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in DOCKERFILES}
    assert set(texts) == {"api.Dockerfile", "worker.Dockerfile", "s3.Dockerfile"}
    assert "libegl" not in texts["s3.Dockerfile"]
    assert "libegl" not in texts["api.Dockerfile"]
    assert "graphics" in texts["worker.Dockerfile"]
    assert "10_nvidia.json" in texts["worker.Dockerfile"]
