"""Property-based tests of every request that the OpenAPI document describes."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
import schemathesis
from farfield_api.app import create_app
from farfield_api.settings import ApiSettings
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis.specs.openapi.checks import positive_data_acceptance
from schemathesis.specs.openapi.schemas import OpenApiSchema

from tests.integration.serving import API, app_over, ready_scene, start_bake

EXAMPLES = 500 if os.environ.get("FARFIELD_SOAK") == "1" else 10

#: what a file or its name means is beyond a schema: these refuse well-formed requests, with 422
REFUSING = {("post", "/api/v1/scenes"), ("post", "/api/v1/uploads")}

#: every operation of the document
OPERATIONS = [
    (method, path)
    for path, methods in create_app(ApiSettings()).openapi()["paths"].items()
    for method in methods
]


@pytest.fixture(scope="module")
def schema(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OpenApiSchema]:
    app = app_over(tmp_path_factory.mktemp("fuzz") / "store")
    with TestClient(app, base_url=f"http://test{API}/") as client:
        ready_scene(client)
        start_bake(client)
        yield schemathesis.openapi.from_asgi(f"{API}/openapi.json", app)


@pytest.mark.parametrize(("method", "path"), OPERATIONS)
def test_every_request(schema: OpenApiSchema, method: str, path: str) -> None:
    """All of schemathesis's checks: no 5xx, documented statuses, types and bodies, refusals."""
    operation = schema[path][method]

    @given(case=operation.as_strategy())
    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.generate],
    )
    def attempt(case: schemathesis.Case) -> None:
        refusing = [positive_data_acceptance] if (method, path) in REFUSING else []
        case.call_and_validate(excluded_checks=refusing)

    attempt()


def test_the_document_has_examples() -> None:
    """Of every body that clients send."""
    document = create_app(ApiSettings()).openapi()
    schemas = document["components"]["schemas"]
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            content = operation.get("requestBody", {}).get("content", {})
            body = content.get("application/json")
            if body is None:
                continue
            name = body["schema"].get("$ref", "").rpartition("/")[2]
            model = schemas.get(name, {})
            examples = (
                "examples" in body
                or "examples" in model
                or all(
                    "examples" in part or "default" in part or "enum" in part or "$ref" in part
                    for part in model.get("properties", {"": {}}).values()
                )
            )
            assert examples, f"{method} {path}"
