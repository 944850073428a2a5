"""Long lists a page at a time: opaque cursors that stay right while the list grows."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Iterable
from typing import Annotated, TypeVar

from farfield_core.errors import BadInputError
from fastapi import Query

T = TypeVar("T")

Limit = Annotated[int, Query(ge=1, le=200, description="Most entries in an answer.")]
Cursor = Annotated[
    str | None, Query(max_length=400, description="`next` of the page before.", examples=["MA"])
]


def encode_cursor(key: str) -> str:
    """What a client sends to get what follows `key`."""
    return base64.urlsafe_b64encode(key.encode()).decode().rstrip("=")


def decode_cursor(cursor: str | None) -> str:
    """The key behind a cursor, empty for none; raises BadInputError."""
    if not cursor:
        return ""
    try:
        return base64.b64decode(cursor + "=" * (-len(cursor) % 4), "-_", validate=True).decode()
    except (binascii.Error, ValueError):
        raise BadInputError("cursor: this is not the `next` of an earlier answer.") from None


def page(
    keys: Iterable[str],
    cursor: str | None,
    limit: int,
    find: Callable[[str], T | None],
    *,
    falling: bool = False,
) -> tuple[list[T], str | None]:
    """A page of what `find` makes of sorted `keys`, None leaving one out; and where to go on.

    Entries are looked at only as far as the page needs. `falling`: keys are sorted the other way.
    """
    after = decode_cursor(cursor)
    found: list[T] = []
    last = ""
    for key in keys:
        if after and (key >= after if falling else key <= after):
            continue
        entry = find(key)
        if entry is None:
            continue
        if len(found) == limit:
            return found, encode_cursor(last)
        found.append(entry)
        last = key
    return found, None
