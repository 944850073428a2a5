"""Every error a client can see, as problem details (RFC 9457): one table, one shape."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from farfield_core import errors
from farfield_core.store import StoreError
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException

log = logging.getLogger(__name__)


class NotNowError(errors.FarfieldError):
    """What was asked does not fit the state a thing is in."""


class UploadGoneError(errors.FarfieldError):
    """The upload did not go on for too long, or was taken back."""


class NoSpaceError(errors.FarfieldError):
    """The disk or the key's quota has no room for it."""


class QuotaError(errors.FarfieldError):
    """More than this server lets one client have."""


#: exception -> HTTP status; the nearest class in an exception's order of bases decides
STATUS: Mapping[type[Exception], HTTPStatus] = {
    NotNowError: HTTPStatus.CONFLICT,
    errors.BadInputError: HTTPStatus.UNPROCESSABLE_ENTITY,
    errors.SceneRefusedError: HTTPStatus.UNPROCESSABLE_ENTITY,
    errors.NotFoundError: HTTPStatus.NOT_FOUND,
    errors.AlreadyExistsError: HTTPStatus.CONFLICT,
    UploadGoneError: HTTPStatus.GONE,
    NoSpaceError: HTTPStatus.INSUFFICIENT_STORAGE,
    QuotaError: HTTPStatus.FORBIDDEN,
    StoreError: HTTPStatus.SERVICE_UNAVAILABLE,
    errors.FarfieldError: HTTPStatus.INTERNAL_SERVER_ERROR,
}


class Problem(BaseModel):
    """Problem details (RFC 9457)."""

    type: str = "about:blank"
    title: str = Field(examples=["Not Found"])
    status: int = Field(examples=[404])
    #: one sentence that says what is wrong and what to do
    detail: str = Field(examples=["There is no bake b-0000; GET /api/v1/bakes lists them."])


#: for `responses=` of routes
PROBLEMS: dict[int | str, dict[str, Any]] = {
    code: {
        "description": HTTPStatus(code).phrase,
        "content": {"application/problem+json": {"schema": Problem.model_json_schema()}},
    }
    for code in (400, 401, 403, 404, 408, 409, 410, 412, 413, 415, 422, 423, 429, 503, 507)
}


def problems(*codes: int) -> dict[int | str, dict[str, Any]]:
    """Documented error responses of a route."""
    return {code: PROBLEMS[code] for code in codes}


def status_of(error: Exception) -> HTTPStatus:
    """HTTP status of an exception."""
    for cls in type(error).__mro__:
        if cls in STATUS:
            return STATUS[cls]
    return HTTPStatus.INTERNAL_SERVER_ERROR


_KNOWN = frozenset(HTTPStatus)


def problem(
    status: int, detail: str, headers: Mapping[str, str] | None = None, title: str = ""
) -> JSONResponse:
    """Build a problem-details response."""
    body = Problem(title=title or HTTPStatus(status).phrase, status=status, detail=detail)
    sent = {"Cache-Control": "no-store", **(headers or {})}
    return JSONResponse(
        body.model_dump(), status, headers=sent, media_type="application/problem+json"
    )


def _sentence(error: RequestValidationError) -> str:
    """Say the first fault of a request, and where it lies."""
    first = error.errors()[0]
    # without the names of pydantic's own that tell the sides of a union apart
    parts = [part for part in map(str, first["loc"][1:]) if "[" not in part and "-str" not in part]
    place = ".".join(parts) or "The body"
    message = str(first["msg"]).removeprefix("Value error, ").rstrip(".")
    return f"{place}: {message[:1].lower()}{message[1:]}."


async def _ours(_: Request, error: Exception) -> JSONResponse:
    return problem(status_of(error), str(error))


async def _validation(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return problem(HTTPStatus.UNPROCESSABLE_ENTITY, _sentence(error))


async def _http(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    if error.status_code not in _KNOWN:  # tus has one of its own, 460
        return problem(error.status_code, str(error.detail), error.headers, "Checksum Mismatch")
    status = HTTPStatus(error.status_code)
    detail = str(error.detail)
    if detail == status.phrase:
        detail = {
            404: "There is nothing at this address; /api/v1/openapi.json lists what there is.",
            405: "This address does not take that method; the Allow header lists those it takes.",
        }.get(status, f"{detail}.")
    return problem(status, detail, error.headers)


async def _unforeseen(request: Request, error: Exception) -> JSONResponse:
    log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return problem(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "The server failed at this request; its log says why, and trying again may help.",
    )


def install(app: FastAPI) -> None:
    """Make `app` answer every error with problem details."""
    app.add_exception_handler(errors.FarfieldError, _ours)
    app.add_exception_handler(RequestValidationError, _validation)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _unforeseen)
