"""GET /bakes/{id}/events: a bake's progress as server-sent events.

Three kinds of event, their data in JSON: `state`, the bake as GET /bakes/{id} gives it, whenever it
changes; `cells`, names of cells that exist, first all of them and then each new one; `end`, after
which nothing follows. An event's id lets a client that comes back hear only what it missed.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated
from uuid import uuid4

import anyio
from fastapi import APIRouter, Depends, Header, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent

from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.names import BakeId
from farfield_api.routers.bakes import describe
from farfield_api.schemas import BakeBody

router = APIRouter(prefix="/bakes", tags=["bakes"])

#: seconds between looks at a bake
INTERVAL = 0.25
#: greatest number of cell names in one event
BATCH = 1000
#: states after which a bake's stream ends
ENDED = ("cancelled", "done", "failed")

#: order of cells is this server process's own: another one's ids mean nothing here
_EPOCH = uuid4().hex[:8]


def _known(service: Service, bake: BakeId) -> None:
    """Answer 404 before the stream has begun."""
    service.bakes.progress(bake)


def _cursor(last_event_id: str | None) -> int:
    """How many cells a client that comes back has heard of."""
    epoch, _, count = (last_event_id or "").partition(":")
    return int(count) if epoch == _EPOCH and count.isdecimal() and len(count) < 10 else 0


@router.get(
    "/{bake}/events",
    response_class=EventSourceResponse,
    responses=problems(404, 422),
    dependencies=[Depends(_known)],
)
async def events(
    request: Request,
    service: Service,
    bake: BakeId,
    last_event_id: Annotated[str | None, Header()] = None,
) -> AsyncIterator[ServerSentEvent]:
    """Follow a bake; ends when the bake does, or without a word when the server stops."""
    cursor = _cursor(last_event_id)
    told: BakeBody | None = None
    while not request.app.state.stopping:
        body = describe(await run_in_threadpool(service.bakes.progress, bake))
        cells = await run_in_threadpool(service.bakes.done_since, bake, cursor)
        while cells:
            batch, cells = cells[:BATCH], cells[BATCH:]
            cursor += len(batch)
            yield ServerSentEvent(event="cells", data=batch, id=f"{_EPOCH}:{cursor}")
        # the rate alone is not news
        if told is None or (told.state, told.cells) != (body.state, body.cells):
            told = body
            yield ServerSentEvent(event="state", data=body)
        if body.state in ENDED:
            yield ServerSentEvent(event="end", data=body.state)
            return
        await anyio.sleep(INTERVAL)
