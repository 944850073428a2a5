"""/farm and /workers: the workers that are alive, and how many are wanted."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from farfield_api.dependencies import Service

router = APIRouter(tags=["farm"])


class Worker(BaseModel):
    """A process that bakes."""

    worker: str
    host: str
    device: str
    #: GL vendor and renderer; empty until its first cell
    renderer: str
    #: what it bakes; empty when idle
    bake: str
    cell: str
    done: int
    #: attempts that went wrong
    tried: int
    #: cells a second
    rate: float
    #: memory of the process that bakes
    megabytes: float
    #: why it was set aside, if it was
    aside: str | None


class Farm(BaseModel):
    """The farm, empty for a server that bakes by itself."""

    #: workers of each kind that the cells still to be baked are worth
    wanted: dict[str, int]
    #: cells still to be baked
    left: int
    workers: list[Worker]


class Workers(BaseModel):
    """Processes that bake, none for a server that bakes by itself."""

    workers: list[Worker]


@router.get("/workers")
def workers(service: Service) -> Workers:
    """List the farm's workers."""
    return Workers(workers=_alive(service))


@router.get("/farm")
def farm(service: Service) -> Farm:
    """Get the farm's workers, and how many it could do with."""
    known = service.farm
    if known is None:
        return Farm(wanted={"cpu": 0, "gpu": 0}, left=0, workers=[])
    wanted = {"cpu": 0, "gpu": 0, service.settings.device: known.wanted()}
    return Farm(wanted=wanted, left=known.left(), workers=_alive(service))


def _alive(service: Service) -> list[Worker]:
    known = service.farm
    if known is None:
        return []
    aside = known.aside()
    return [
        Worker(
            worker=slot.worker,
            host=slot.host,
            device=slot.device,
            renderer=slot.renderer,
            bake=slot.bake,
            cell=slot.cell,
            done=slot.done,
            tried=slot.tried,
            rate=slot.rate,
            megabytes=slot.megabytes,
            aside=aside.get(slot.worker),
        )
        for slot in known.slots()
    ]
