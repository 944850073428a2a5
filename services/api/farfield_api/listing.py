"""Long lists a page at a time: opaque cursors that stay right while the list grows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated, TypeVar

from fastapi import Query

T = TypeVar("T")

Limit = Annotated[int, Query(ge=1, le=200, description="Most entries in an answer.")]
Cursor = Annotated[
    str | None,
    Query(
        pattern=r"^([0-9a-f]{2}){1,200}$",
        description="`next` of the page before.",
        examples=["33663163"],
    ),
]


def encode_cursor(key: str) -> str:
    """What a client sends to get what follows `key`."""
    return key.encode().hex()


def decode_cursor(cursor: str | None) -> str:
    """The key behind a cursor, empty for none; one that is made up means some place in the list."""
    return bytes.fromhex(cursor or "").decode("utf-8", "replace")


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
