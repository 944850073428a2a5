"""Whether a request may pass: its key, the key's scope, and how many requests it has left."""

from __future__ import annotations

import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from http import HTTPStatus

from fastapi.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from farfield_api.exceptions import problem
from farfield_api.keys import Key, Keys, KeyScope

COOKIE = "farfield_key"

#: (methods, path below the API's prefix) that need no key: a bake's id is a secret of its own
_OPEN = (
    ({"GET", "HEAD"}, re.compile(r"/(health|ready|openapi\.json)$")),
    ({"GET", "HEAD"}, re.compile(r"/walks/[^/]+/.*")),
    ({"GET"}, re.compile(r"/bakes/[a-z0-9-]+(/events)?$")),
    ({"POST"}, re.compile(r"/bakes/[a-z0-9-]+/focus$")),
    ({"POST", "DELETE"}, re.compile(r"/session$")),
    ({"OPTIONS"}, re.compile(r".*")),
)
#: keys whose requests are counted at the same time
_COUNTED = 10_000


def needed_scope(method: str, path: str) -> KeyScope | None:
    """Scope that a request needs, its path below the API's prefix; None: none at all."""
    if any(method in methods and pattern.match(path) for methods, pattern in _OPEN):
        return None
    if path.startswith("/keys"):
        return "admin"
    return "read" if method in ("GET", "HEAD") else "write"


class Auth:
    """ASGI middleware.

    Args:
        app: what is protected.
        prefix: of the API; metrics are protected too, pages are not.
        keys: finds keys; asked for at the first request.
        rate: requests a minute that change something, for each key; 0 for any.
    """

    def __init__(self, app: ASGIApp, prefix: str, keys: Callable[[Scope], Keys], rate: int) -> None:
        self._app = app
        self._prefix = prefix
        self._keys = keys
        self._buckets = Buckets(rate)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        path = scope["path"] if scope["type"] == "http" else ""
        guarded = path.startswith(f"{self._prefix}/") or path == "/metrics"
        needed = needed_scope(scope["method"], path.removeprefix(self._prefix)) if guarded else None
        if needed is None:
            await self._app(scope, receive, send)
            return
        secret = shown(HTTPConnection(scope))
        key: Key | None = None
        if secret:
            key = await run_in_threadpool(self._keys(scope).find, secret)
        if key is None:
            sentence = (
                "This key is not known here, or works no more; ask whoever runs the server."
                if secret
                else "This needs a key; send it as `Authorization: Bearer KEY`."
            )
            answer = problem(HTTPStatus.UNAUTHORIZED, sentence, {"WWW-Authenticate": "Bearer"})
        elif not key.allows(needed):
            answer = problem(
                HTTPStatus.FORBIDDEN,
                f"The key {key.name} has the scope {key.scope}; this needs {needed}.",
            )
        elif needed != "read" and (wait := self._buckets.wait(key.id, scope["method"])) > 0:
            answer = problem(
                HTTPStatus.TOO_MANY_REQUESTS,
                f"The key {key.name} asks too often; try again in {wait:.0f} s.",
                {"Retry-After": str(int(wait) + 1)},
            )
        else:
            scope["farfield.key"] = key
            await self._app(scope, receive, send)
            return
        await answer(scope, receive, send)


class OwnPages:
    """ASGI middleware: pages of other sites change nothing, unless their origins are allowed.

    A server on loopback asks for no key, and a page of any site could post a form to it. Browsers
    say where a request comes from (Sec-Fetch-Site); programs do not, and need not.
    """

    def __init__(self, app: ASGIApp, origins: Sequence[str]) -> None:
        self._app = app
        self._origins = frozenset(origins)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD", "OPTIONS"):
            headers = HTTPConnection(scope).headers
            allowed = "*" in self._origins or headers.get("origin") in self._origins
            if headers.get("sec-fetch-site") == "cross-site" and not allowed:
                sentence = "Pages of other sites may change nothing here; see FARFIELD_CORS."
                await problem(HTTPStatus.FORBIDDEN, sentence)(scope, receive, send)
                return
        await self._app(scope, receive, send)


def shown(connection: HTTPConnection) -> str:
    """The key that a client shows: in a header, or a page's in its cookie; empty if none."""
    kind, _, secret = connection.headers.get("authorization", "").partition(" ")
    if kind.lower() == "bearer":
        return secret.strip()
    return connection.cookies.get(COOKIE, "")


class Buckets:
    """A token bucket for each key: `rate` requests a minute, up to that many at once."""

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._lock = threading.Lock()
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, key: str, method: str = "POST") -> float:
        """Take one request; seconds to wait if there is none left, else 0.

        Parts of an upload are not counted: how many there are says nothing about their cost.
        """
        if self._rate == 0 or method == "PATCH":
            return 0.0
        now, pace = time.monotonic(), self._rate / 60
        with self._lock:
            left, then = self._left.pop(key, (float(self._rate), now))
            left = min(float(self._rate), left + (now - then) * pace)
            short = left < 1
            self._left[key] = (left if short else left - 1, now)
            while len(self._left) > _COUNTED:
                self._left.popitem(last=False)
        return (1 - left) / pace if short else 0.0
