"""Property-based tests of every request that the OpenAPI document describes."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import NamedTuple

import pytest
import schemathesis
from farfield_api.app import create_app
from farfield_api.names import IS_ID
from farfield_api.settings import ApiSettings
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings, strategies
from schemathesis.specs.openapi.checks import positive_data_acceptance
from schemathesis.specs.openapi.schemas import OpenApiSchema

from tests.integration.serving import API, app_over, ready_scene, start_bake

EXAMPLES = 500 if os.environ.get("FARFIELD_SOAK") == "1" else 10

#: What no JSON Schema can say, because it compares two numbers, counts, or reads a file's name:
#: only with these sentences may the server refuse, with 422 or 413, what the document allows.
BEYOND_SCHEMA = re.compile(
    r"the box is empty along|lies inside the cell; use more than|is for layers; choose layers"
    r"|cells, more than 2000000|more than 2000000 cells|needs more than 4096 layers"
    r"|cannot be read as a model; give one of|bytes; this server takes|is no UTF-8 in Base64"
)

#: every operation of the document
OPERATIONS = [
    (method, path)
    for path, methods in create_app(ApiSettings()).openapi()["paths"].items()
    for method in methods
]


class Served(NamedTuple):
    """The document, and what there is to ask for."""

    schema: OpenApiSchema
    ids: dict[str, str]

    def name_what_exists(self, case: schemathesis.Case) -> None:
        """Put ids of things that exist where the case has well-formed ones of its own."""
        for name, value in self.ids.items():
            if re.fullmatch(IS_ID, str((case.path_parameters or {}).get(name, ""))):
                case.path_parameters[name] = value
            body = case.body if isinstance(case.body, dict) else {}
            if isinstance(body.get(name), str) and re.fullmatch(IS_ID, body[name]):
                body[name] = value


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    app = app_over(tmp_path_factory.mktemp("fuzz") / "store")
    with TestClient(app, base_url=f"http://test{API}/") as client:
        ids = {"scene": ready_scene(client), "bake": start_bake(client)}
        yield Served(schemathesis.openapi.from_asgi(f"{API}/openapi.json", app), ids)


@pytest.mark.parametrize(("method", "path"), OPERATIONS)
def test_every_request(served: Served, method: str, path: str) -> None:
    """All of schemathesis's checks: no 5xx, documented statuses, types and bodies, refusals."""
    operation = served.schema[path][method]

    @given(case=operation.as_strategy(), exists=strategies.booleans())
    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.generate],
    )
    def attempt(case: schemathesis.Case, exists: bool) -> None:
        if exists:
            served.name_what_exists(case)
        answer = case.call()
        beyond = answer.status_code in (413, 422) and BEYOND_SCHEMA.search(answer.json()["detail"])
        case.validate_response(answer, excluded_checks=[positive_data_acceptance] if beyond else [])

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
