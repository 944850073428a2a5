"""/keys: who may call; /session: a key for the pages of this server."""

from __future__ import annotations

from datetime import timedelta
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request
from fastapi.responses import Response
from starlette.exceptions import HTTPException

from farfield_api.auth import COOKIE
from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.keys import Key
from farfield_api.schemas import KeyBody, KeyList, KeyRequest, NewKey, Rotation, Session

router = APIRouter(tags=["keys"])

KeyId = Annotated[str, Path(pattern=r"^[a-z0-9-]{1,64}$", description="A key's id.")]


def _body(key: Key) -> KeyBody:
    return KeyBody(**key.model_dump(exclude={"hash"}))


@router.get("/keys", responses=problems(401, 403))
def keys(service: Service) -> KeyList:
    """List all keys, oldest first."""
    return KeyList(keys=[_body(key) for key in service.keys.list()])


@router.post("/keys", status_code=201, responses=problems(401, 403, 422))
def add_key(service: Service, wanted: KeyRequest) -> NewKey:
    """Make a key."""
    key, secret = service.keys.create(wanted.name, wanted.scope)
    return NewKey(**_body(key).model_dump(), key=secret)


@router.post("/keys/{key}/rotate", status_code=201, responses=problems(401, 403, 404, 422))
def rotate_key(service: Service, key: KeyId, rotation: Rotation) -> NewKey:
    """Make a successor of a key; both work for a while."""
    made, secret = service.keys.rotate(key, timedelta(hours=rotation.overlap_hours))
    return NewKey(**_body(made).model_dump(), key=secret)


@router.delete("/keys/{key}", status_code=204, responses=problems(401, 403, 404, 422))
def revoke_key(service: Service, key: KeyId) -> None:
    """End a key at once."""
    service.keys.revoke(key)


@router.post("/session", status_code=204, responses=problems(401, 422))
def begin_session(request: Request, service: Service, session: Session) -> Response:
    """Let the pages of this server, in this browser, use a key."""
    if service.settings.needs_keys and service.keys.find(session.key) is None:
        raise HTTPException(
            HTTPStatus.UNAUTHORIZED, "This key is not known here; ask whoever runs the server."
        )
    answer = Response(None, 204)
    secure = request.url.scheme == "https" or service.settings.base_url.startswith("https:")
    answer.set_cookie(
        COOKIE, session.key, max_age=30 * 86400, httponly=True, samesite="strict", secure=secure
    )
    return answer


@router.delete("/session", status_code=204)
def end_session() -> Response:
    """Let the pages of this server, in this browser, forget their key."""
    answer = Response(None, 204)
    answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
    return answer
