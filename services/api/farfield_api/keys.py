"""API keys: who may call what. Only hashes are kept, in the store, so all servers know them.

A key is 256 random bits, so one round of SHA-256 hides it well. Whoever knows a bake's id may walk
and watch it without a key: that is what a share link is. Everything else needs a scope.
"""

from __future__ import annotations

import hashlib
import secrets
import threading
import time
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Literal

from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.store import Store
from farfield_core.validation import parse
from fastapi import Request
from pydantic import BaseModel, ConfigDict

KeyScope = Literal["read", "write", "admin"]
SCOPES: tuple[KeyScope, ...] = ("read", "write", "admin")

#: seconds for which keys of the store are remembered: how late another server's word may arrive
_FRESH = 5.0
_PREFIX = "keys/"


class Key(BaseModel):
    """A key as it is kept."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    name: str
    scope: KeyScope
    #: SHA-256 of the key, hexadecimal
    hash: str
    created: datetime
    #: when it ceases to work; None: never
    expires: datetime | None = None

    def allows(self, scope: KeyScope) -> bool:
        """Whether the key's scope includes another."""
        return SCOPES.index(self.scope) >= SCOPES.index(scope)


def hash_of(secret: str) -> str:
    """What is kept of a key."""
    return hashlib.sha256(secret.encode()).hexdigest()


class Keys:
    """The keys of a store, and those that the settings give."""

    def __init__(self, store: Store, fixed: str = "") -> None:
        self._store = store
        self._fixed = list(_fixed(fixed))
        self._lock = threading.Lock()
        self._known: dict[str, Key] = {}
        self._read = -1e9

    def find(self, secret: str) -> Key | None:
        """The key that a client shows, None if there is none or it has ceased to work."""
        key = self._all().get(hash_of(secret))
        if key is None or (key.expires is not None and key.expires < datetime.now(UTC)):
            return None
        return key

    def list(self) -> list[Key]:
        """All keys, oldest first."""
        return sorted(self._all(fresh=True).values(), key=lambda key: (key.created, key.id))

    def create(self, name: str, scope: KeyScope) -> tuple[Key, str]:
        """Make a key; returns what is kept and the key itself, which nobody can tell again."""
        secret = f"farfield_{secrets.token_urlsafe(32)}"
        key = Key(
            id=secrets.token_hex(8),
            name=name,
            scope=scope,
            hash=hash_of(secret),
            created=datetime.now(UTC),
        )
        self._put(key)
        return key, secret

    def rotate(self, identity: str, overlap: timedelta) -> tuple[Key, str]:
        """Make a new key of the same name and scope; the old one works for `overlap` more.

        Raises NotFoundError.
        """
        old = self._get(identity)
        made = self.create(old.name, old.scope)
        end = datetime.now(UTC) + overlap
        expires = end if old.expires is None else min(end, old.expires)
        self._put(old.model_copy(update={"expires": expires}))
        return made

    def revoke(self, identity: str) -> None:
        """End a key at once; raises NotFoundError."""
        self._get(identity)
        self._store.delete(f"{_PREFIX}{identity}.json")
        with self._lock:
            self._read = -1e9

    def _get(self, identity: str) -> Key:
        try:
            data = self._store.get(f"{_PREFIX}{identity}.json")
        except NotFoundError:
            raise NotFoundError(
                f"There is no key {identity} in the store; GET /api/v1/keys lists them."
            ) from None
        return parse(Key, data, f"The key {identity}")

    def _put(self, key: Key) -> None:
        self._store.put(f"{_PREFIX}{key.id}.json", key.model_dump_json().encode())
        with self._lock:
            self._read = -1e9

    def _all(self, fresh: bool = False) -> dict[str, Key]:
        with self._lock:
            if fresh or time.monotonic() - self._read > _FRESH:
                found = [
                    parse(Key, self._store.get(name), f"The key {name}")
                    for name in self._store.list(_PREFIX)
                ]
                self._known = {key.hash: key for key in [*self._fixed, *found]}
                self._read = time.monotonic()
            return self._known


def _fixed(text: str) -> Iterable[Key]:
    """Keys of a setting; raises BadInputError."""
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, _, rest = part.partition(":")
        scope, _, hashed = rest.partition(":")
        good = len(hashed) == 64 and set(hashed.lower()) <= set("0123456789abcdef")
        if not name or scope not in SCOPES or not good:
            raise BadInputError(
                "FARFIELD_API_KEYS holds an entry that is not name:scope:sha256, with one of the "
                "scopes read, write and admin; `farfield keys hash` makes one."
            )
        yield Key(
            id=f"fixed-{hashed[:8].lower()}",
            name=name,
            scope=scope,
            hash=hashed.lower(),
            created=datetime.fromtimestamp(0, UTC),
        )


def owner_of(request: Request) -> str:
    """Name of the key that a request came with; empty without one."""
    key: Key | None = request.scope.get("farfield.key")
    return key.name if key else ""
