"""Parts of the API that need no server."""

import json
from http import HTTPStatus
from pathlib import Path

import pytest
from farfield_api.app import create_app
from farfield_api.exceptions import STATUS, NotNowError, status_of
from farfield_api.scenes import safe_name
from farfield_api.settings import ApiSettings
from farfield_core import errors
from farfield_core.errors import BadInputError, FarfieldError
from hypothesis import given
from hypothesis import strategies as st


def test_settings_come_from_the_environment_and_options_win() -> None:
    environ = {"FARFIELD_STORE": "there", "FARFIELD_JOBS": "3", "FARFIELD_BROKER": "", "HOME": "x"}
    settings = ApiSettings.from_environment(environ, store=None, jobs=5)
    assert (settings.store, settings.jobs, settings.broker) == ("there", 5, "")


@pytest.mark.parametrize(
    ("variable", "value"), [("FARFIELD_JOBS", "none"), ("FARFIELD_UPLOAD_LIMIT", "-1")]
)
def test_a_bad_variable_is_named(variable: str, value: str) -> None:
    with pytest.raises(BadInputError, match=f"{variable} cannot be '{value}'"):
        ApiSettings.from_environment({variable: value})


@given(st.text(max_size=300))
def test_safe_names_stay_in_their_folder(name: str) -> None:
    safe = safe_name(name)
    assert len(safe) <= 112
    assert not set(safe) & set('/\\\0\n\r:*?"<>|#')
    assert not safe.startswith(".") or safe == "."
    if safe not in ("", "."):
        assert (Path("/folder") / safe).resolve() == Path("/folder") / safe


def test_plain_names_stay_as_they_are() -> None:
    for name in ("town.glb", "Château (2).obj", "a-b_c d.STL"):
        assert safe_name(name) == name


def test_every_error_of_ours_has_a_status() -> None:
    ours = [
        e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, FarfieldError)
    ]
    statuses = {cls.__name__: status_of(cls("")) for cls in [*ours, NotNowError]}
    assert statuses["NotFoundError"] == HTTPStatus.NOT_FOUND
    assert statuses["SceneRefusedError"] == statuses["BadInputError"] == 422
    assert statuses["AlreadyExistsError"] == statuses["NotNowError"] == HTTPStatus.CONFLICT
    assert status_of(KeyError()) == HTTPStatus.INTERNAL_SERVER_ERROR
    assert all(issubclass(cls, FarfieldError) for cls in STATUS)


def test_openapi_names_every_operation_once_and_gives_examples(tmp_path: Path) -> None:
    schema = create_app(ApiSettings(store=str(tmp_path), web=tmp_path)).openapi()
    operations = [operation for path in schema["paths"].values() for operation in path.values()]
    names = [operation["operationId"] for operation in operations]
    assert len(names) == len(set(names)) >= 20
    assert all(operation.get("description") for operation in operations)
    text = json.dumps(schema)
    assert "near_field" in text
    assert schema["components"]["schemas"]["BakeRequest"]["examples"][0]["settings"]["layers"] == 64
