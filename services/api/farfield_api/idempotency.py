"""Idempotency-Key on POST: the same request, sent again, gets the first answer and does nothing.

Answers are kept in the store for a day, so any server gives them. Models sent in one request are
left alone: their ids are hashes of their bytes, so sending one again is harmless.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import json
import re
import time
from http import HTTPStatus
from typing import Any

from farfield_core.errors import NotFoundError
from farfield_core.store import Store
from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from farfield_api.exceptions import problem
from farfield_api.keys import owner_of

#: seconds for which an answer is remembered
LIFETIME = 24 * 3600.0
#: greatest answer that is remembered, bytes
_LARGEST = 1 << 20
_KEY = re.compile(r"^[\x21-\x7e]{1,255}$")
#: headers that belong to what is asked for
_ASKED = ("upload-length", "upload-metadata")
_PREFIX = "requests/"


class Idempotency:
    """ASGI middleware, inside whatever limits bodies and finds out whose request it is."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._under_way: set[str] = set()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http" or scope["method"] != "POST":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        sent = headers.get("idempotency-key")
        kind = headers.get("content-type", "")
        if sent is None or kind.startswith(("multipart/", "application/offset+octet-stream")):
            await self._app(scope, receive, send)
            return
        if not _KEY.match(sent):
            sentence = "Idempotency-Key: it has to be 1 to 255 visible ASCII characters."
            await problem(HTTPStatus.UNPROCESSABLE_ENTITY, sentence)(scope, receive, send)
            return
        request = Request(scope, receive)
        body = await request.body()
        who = f"{owner_of(request)} {sent}"
        place = f"{_PREFIX}{hashlib.sha256(who.encode()).hexdigest()[:32]}.json"
        if place in self._under_way:
            sentence = "A request with this Idempotency-Key is being worked on; wait for it."
            await problem(HTTPStatus.CONFLICT, sentence)(scope, receive, send)
            return
        self._under_way.add(place)
        try:
            await self._once(scope, send, place, _fingerprint(scope, headers, body), body)
        finally:
            self._under_way.discard(place)

    async def _once(
        self, scope: Scope, send: Send, place: str, fingerprint: str, body: bytes
    ) -> None:
        store: Store = scope["app"].state.service.store
        receive = _replay(body)
        known = await run_in_threadpool(_read, store, place)
        if known is not None:
            answer: Response
            if known["fingerprint"] != fingerprint:
                answer = problem(
                    HTTPStatus.UNPROCESSABLE_ENTITY,
                    "This Idempotency-Key came with another request before; use a new one.",
                )
            else:
                answer = Response(base64.b64decode(known["body"]), known["status"])
                answer.raw_headers = [
                    *((k.encode("latin-1"), v.encode("latin-1")) for k, v in known["headers"]),
                    (b"idempotency-replayed", b"true"),
                ]
            await answer(scope, receive, send)
            return
        start: Message = {}
        content = bytearray()

        async def kept(message: Message) -> None:
            if message["type"] == "http.response.start":
                start.update(message)
            elif message["type"] == "http.response.body" and len(content) <= _LARGEST:
                content.extend(message.get("body", b""))
            await send(message)

        await self._app(scope, receive, kept)
        # what was refused may be asked for again once the cause is gone
        if 200 <= start.get("status", 500) < 300 and len(content) <= _LARGEST:
            answered = {
                "fingerprint": fingerprint,
                "time": time.time(),
                "status": start["status"],
                "headers": [
                    (k.decode("latin-1"), v.decode("latin-1")) for k, v in start["headers"]
                ],
                "body": base64.b64encode(content).decode(),
            }
            await run_in_threadpool(store.put, place, json.dumps(answered).encode())


def forget_old(store: Store) -> None:
    """Remove answers that are remembered no more."""
    for place in list(store.list(_PREFIX)):
        if _read(store, place) is None:
            store.delete(place)


def _read(store: Store, place: str) -> Any:
    with contextlib.suppress(NotFoundError, ValueError, KeyError, TypeError):
        known = json.loads(store.get(place))
        if time.time() - known["time"] < LIFETIME:
            return known
    return None


def _fingerprint(scope: Scope, headers: Headers, body: bytes) -> str:
    parts = [scope["path"], scope["query_string"].decode("latin-1")]
    parts += [headers.get(name, "") for name in _ASKED]
    return hashlib.sha256(json.dumps(parts).encode() + body).hexdigest()


def _replay(body: bytes) -> Receive:
    """A body that was read already, once more."""
    messages: list[Message] = [
        {"type": "http.disconnect"},
        {"type": "http.request", "body": body, "more_body": False},
    ]

    async def receive() -> Message:
        return messages.pop() if len(messages) > 1 else messages[0]

    return receive
