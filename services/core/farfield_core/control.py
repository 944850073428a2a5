"""What a bake is wanted to do, and how it failed: kept in the store, beside its cells.

    bakes/<bake>/control.json                     what was asked for last, or how the bake failed
    bakes/<bake>/attempts/<i>_<j>_<k>/<name>.json  how a farm worker failed to bake a cell

The cells themselves tell what is done, so a server may be killed at any time and whoever comes next
reads the same. A bake without control.json, made by the command line, waits to be resumed.
"""

from __future__ import annotations

import secrets
from collections.abc import Container, Iterator, Mapping
from datetime import UTC, datetime
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from farfield_core import layout
from farfield_core.cells import cell_name, parse_cell_name
from farfield_core.errors import NotFoundError
from farfield_core.store import Store
from farfield_core.validation import parse

Wanted = Literal["running", "paused", "cancelled", "failed"]


class Control(BaseModel):
    """control.json."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    wanted: Wanted = "paused"
    #: when the bake was first asked for; bakes are taken up in this order
    created: datetime = Field(default_factory=lambda: datetime.now(UTC))
    #: of a failed bake: a sentence for each cell, by its name, and one for the bake as a whole
    reasons: dict[str, str] = {}
    reason: str | None = None


def _control_key(bake: str) -> str:
    return f"{layout.bake_prefix(bake)}control.json"


def read_control(store: Store, bake: str) -> Control | None:
    """What is wanted of a bake; None where nobody has said."""
    try:
        data = store.get(_control_key(bake))
    except NotFoundError:
        return None
    return parse(Control, data, f"The control file of bake {bake}")


def write_control(
    store: Store,
    bake: str,
    wanted: Wanted,
    reasons: Mapping[str, str] | None = None,
    reason: str | None = None,
) -> Control:
    """Say what is wanted of a bake; the time of its creation stays."""
    before = read_control(store, bake) or Control()
    control = Control(
        wanted=wanted, created=before.created, reasons=dict(reasons or {}), reason=reason
    )
    store.put(_control_key(bake), control.model_dump_json().encode())
    return control


class Attempt(BaseModel):
    """Who tried to bake a cell in vain, and what went wrong."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    worker: str
    reason: str


def _attempts_prefix(bake: str) -> str:
    return f"{layout.bake_prefix(bake)}attempts/"


def write_attempt(store: Store, bake: str, cell: str, attempt: Attempt) -> str:
    """A farm worker failed to bake a cell; returns the attempt's name."""
    name = secrets.token_hex(8)
    key = f"{_attempts_prefix(bake)}{cell_name(parse_cell_name(cell))}/{name}.json"
    store.put_new(key, attempt.model_dump_json().encode())
    return name


def read_attempts(
    store: Store, bake: str, known: Container[str] = ()
) -> Iterator[tuple[str, str, Attempt]]:
    """Cell, name and story of each attempt that failed, but for names in `known`."""
    prefix = _attempts_prefix(bake)
    for key in store.list(prefix):
        cell, _, file = key.removeprefix(prefix).partition("/")
        name = file.removesuffix(".json")
        if name not in known:
            yield cell, name, parse(Attempt, store.get(key), f"The attempt {key}")


def forget_attempts(store: Store, bake: str) -> None:
    """Let given-up cells be tried again."""
    store.delete_prefix(_attempts_prefix(bake))
