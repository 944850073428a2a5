"""/bakes: asking for cells, and watching them arrive."""

from __future__ import annotations

from fastapi import APIRouter

from farfield_api.bakes import Progress
from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.names import BakeId
from farfield_api.schemas import (
    BakeBody,
    BakeList,
    BakeRequest,
    CellCounts,
    FailedCell,
    Focus,
    NewBake,
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


@router.post("", status_code=201, responses=problems(404, 409, 422))
def add_bake(service: Service, request: BakeRequest) -> NewBake:
    """Ask for a bake. The same scene, corridor and settings are the same bake."""
    corridor = service.corridor(request.scene, request.corridor)
    return NewBake(id=service.create_bake(request.scene, corridor, request.settings))


@router.get("")
def bakes(service: Service) -> BakeList:
    """List all bakes, in the order in which they were asked for."""
    known = service.bakes
    return BakeList(bakes=[describe(known.progress(bake)) for bake in known.ids()])


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
