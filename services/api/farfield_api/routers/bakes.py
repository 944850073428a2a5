"""/bakes: asking for cells, and watching them arrive."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request

from farfield_api.bakes import Progress
from farfield_api.dependencies import Service, known_scene_in_body
from farfield_api.exceptions import problems
from farfield_api.listing import Cursor, Limit, page
from farfield_api.names import BakeId
from farfield_api.schemas import (
    BakeBody,
    BakeList,
    BakeRequest,
    CellCounts,
    FailedCell,
    Focus,
    NewBake,
    State,
)

router = APIRouter(prefix="/bakes", tags=["bakes"])


def describe(progress: Progress) -> BakeBody:
    """A bake as clients see it."""
    walk, status, rate = progress.walk, progress.status, progress.rate
    left = status.total - status.done - status.failed
    moving = rate if status.state == "running" else None
    return BakeBody(
        id=walk.id,
        name=walk.name,
        scene=walk.scene.id,
        state=status.state,
        reason=status.reason,
        cells=CellCounts(total=status.total, done=status.done, failed=status.failed),
        rate=moving,
        seconds_left=left / moving if moving else None,
        failures=[FailedCell(cell=cell, reason=why) for cell, why in status.reasons.items()],
    )


@router.post(
    "",
    status_code=201,
    responses=problems(403, 404, 409, 422),
    dependencies=[Depends(known_scene_in_body)],
)
def add_bake(http: Request, service: Service, request: BakeRequest) -> NewBake:
    """Ask for a bake. The same scene, corridor and settings are the same bake."""
    corridor = service.corridor(request.scene, request.corridor)
    bake = service.create_bake(request.scene, corridor, request.settings, request.follows)
    http.app.state.tracing.asked(bake)
    return NewBake(id=bake)


@router.get("", responses=problems(422))
def bakes(
    service: Service,
    limit: Limit = 100,
    cursor: Cursor = None,
    order: Literal["oldest", "newest"] = "oldest",
    state: State | None = None,
    scene: Annotated[str | None, Query(pattern=r"^[a-z0-9-]{1,64}$")] = None,
) -> BakeList:
    """List bakes, in the order in which they were asked for."""
    known = service.bakes

    def find(key: str) -> BakeBody | None:
        bake = key.rpartition(" ")[2]
        if scene is not None and known.walk(bake).scene.id != scene:
            return None
        body = describe(known.progress(bake))
        return body if state in (None, body.state) else None

    keys = known.order()
    newest = order == "newest"
    found, following = page(keys[::-1] if newest else keys, cursor, limit, find, falling=newest)
    return BakeList(bakes=found, next=following)


@router.get("/{bake}", responses=problems(404, 422))
def bake(service: Service, bake: BakeId) -> BakeBody:
    """Get a bake, and how far it has come."""
    return describe(service.bakes.progress(bake))


@router.post("/{bake}/pause", responses=problems(404, 409, 422))
def pause(service: Service, bake: BakeId) -> BakeBody:
    """Begin no more cells; those under way are finished."""
    service.bakes.pause(bake)
    return describe(service.bakes.progress(bake))


@router.post("/{bake}/resume", responses=problems(404, 409, 422))
def resume(service: Service, bake: BakeId) -> BakeBody:
    """Go on with a paused or cancelled bake."""
    service.bakes.resume(bake)
    return describe(service.bakes.progress(bake))


@router.post("/{bake}/cancel", responses=problems(404, 409, 422))
def cancel(service: Service, bake: BakeId) -> BakeBody:
    """Stop at once; what is baked stays, and can be walked."""
    service.bakes.cancel(bake)
    return describe(service.bakes.progress(bake))


@router.post("/{bake}/retry", responses=problems(404, 409, 422))
def retry(service: Service, bake: BakeId) -> BakeBody:
    """Try the failed cells anew."""
    service.bakes.retry(bake)
    return describe(service.bakes.progress(bake))


@router.post("/{bake}/focus", status_code=204, responses=problems(404, 422))
def focus(service: Service, bake: BakeId, where: Focus) -> None:
    """Tell where a walker stands: cells near it are baked first."""
    service.bakes.focus(bake, where.cell)
