"""The Helm chart: linted, rendered, and every object checked against Kubernetes' own schemas.

None of it has met a cluster. Where Helm could not be built, only the chart's values are checked.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import jsonschema
import kubernetes_validate
import pytest
from farfield_worker.farm.bakers import Limits
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
CHART = ROOT / "deploy/helm/farfield"
BUILT = ROOT / ".venv/bin/helm"
HELM = str(BUILT) if BUILT.exists() else shutil.which("helm")

#: what a cluster may be given
VARIANTS: dict[str, list[str]] = {
    "default": [],
    "gpu": ["workers.gpu.enabled=true", "api.device=gpu", "workers.cpu.enabled=false"],
    "elsewhere": [
        "redis.enabled=false",
        "redis.secret=broker",
        "store.secret=s3-keys",
        "store.endpoint=https://s3.example.org",
        "api.allowFrom.app=ingress",
        "images.pullSecrets[0]=registry",
        "serviceAccount=baker",
    ],
    "fixed": ["keda.enabled=false", "networkPolicy.enabled=false", "workers.cpu.min=3"],
}


def helm(*arguments: str) -> str:
    assert HELM
    out = subprocess.run([HELM, *arguments], check=True, capture_output=True, text=True)
    return out.stdout


def render(values: list[str]) -> list[dict[str, Any]]:
    options = [option for value in values for option in ("--set", value)]
    text = helm("template", "farm", str(CHART), "--namespace", "bakery", *options)
    return [thing for thing in YAML(typ="safe").load_all(text) if thing]


def values() -> dict[str, Any]:
    loaded: dict[str, Any] = YAML(typ="safe").load(CHART / "values.yaml")
    return loaded


def schema() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((CHART / "values.schema.json").read_text("utf-8"))
    return loaded


def named(things: list[dict[str, Any]], kind: str) -> dict[str, dict[str, Any]]:
    return {t["metadata"]["name"]: t for t in things if t["kind"] == kind}


def containers(things: list[dict[str, Any]]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    pods = [t["spec"]["template"]["spec"] for t in things if "template" in t.get("spec", {})]
    return [(pod, container) for pod in pods for container in pod["containers"]]


def test_values_fit_their_schema() -> None:
    jsonschema.Draft7Validator.check_schema(schema())
    jsonschema.validate(values(), schema())


@pytest.mark.parametrize(
    ("path", "wrong"),
    [
        (("store", "url"), "/a/folder"),
        (("workers", "cpu", "jobs"), 0),
        (("workers", "cpu", "jbos"), 4),
        (("api", "device"), "tpu"),
        (("keda", "enabled"), "yes"),
    ],
)
def test_wrong_values_do_not(path: tuple[str, ...], wrong: object) -> None:
    changed = values()
    at = changed
    for name in path[:-1]:
        at = at[name]
    at[path[-1]] = wrong
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(changed, schema())


def test_pods_have_longer_than_a_cell() -> None:
    assert values()["cellSeconds"] == Limits().seconds


if HELM:

    def test_helm_finds_nothing_wrong() -> None:
        assert "0 chart(s) failed" in helm("lint", "--strict", str(CHART))

    @pytest.mark.parametrize("variant", VARIANTS)
    def test_kubernetes_accepts_every_object(variant: str) -> None:
        things = render(VARIANTS[variant])
        assert len(things) >= 4
        for thing in things:
            if thing["kind"] != "ScaledObject":
                kubernetes_validate.validate(thing, "1.37", strict=True)

    @pytest.mark.parametrize("variant", VARIANTS)
    def test_no_container_is_root_or_unbounded(variant: str) -> None:
        found = containers(render(VARIANTS[variant]))
        assert found
        for pod, container in found:
            assert pod["securityContext"]["runAsNonRoot"] is True
            assert container["securityContext"]["readOnlyRootFilesystem"] is True
            assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
            assert container["resources"]["requests"]["cpu"]
            assert container["resources"]["limits"]["memory"]
            assert container["livenessProbe"]

    def test_workers_end_after_their_cell() -> None:
        deployments = named(render([]), "Deployment")
        pod = deployments["farm-worker-cpu"]["spec"]["template"]["spec"]
        assert pod["terminationGracePeriodSeconds"] > values()["cellSeconds"]

    def test_keda_scales_workers_by_what_the_api_wants() -> None:
        things = render(["workers.gpu.enabled=true"])
        scaled = named(things, "ScaledObject")
        assert set(scaled) == {"farm-worker-cpu", "farm-worker-gpu"}
        port = named(things, "Service")["farm-api"]["spec"]["ports"][0]["port"]
        for name, thing in scaled.items():
            spec = thing["spec"]
            assert spec["scaleTargetRef"]["name"] in named(things, "Deployment")
            (trigger,) = spec["triggers"]
            assert trigger["type"] == "metrics-api"
            metadata = trigger["metadata"]
            assert metadata["url"] == f"http://farm-api.bakery.svc:{port}/api/v1/farm"
            assert metadata["valueLocation"] == f"wanted.{name.rsplit('-', 1)[1]}"
            # KEDA's number of replicas must not be fought over
            deployment = named(things, "Deployment")[name]
            assert "replicas" not in deployment["spec"]
        # scenes are prepared by the workers that the API feeds
        assert scaled["farm-worker-cpu"]["spec"]["minReplicaCount"] == 1
        assert scaled["farm-worker-gpu"]["spec"]["minReplicaCount"] == 0

    def test_secrets_are_named_and_never_written() -> None:
        things = render(VARIANTS["elsewhere"])
        assert not named(things, "Secret")
        for _, container in containers(things):
            if container["name"] == "web":  # it speaks to nobody but the API
                assert "env" not in container
                continue
            env = {entry["name"]: entry for entry in container["env"]}
            for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "FARFIELD_BROKER"):
                assert "secretKeyRef" in env[name]["valueFrom"]
