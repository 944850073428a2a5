"""POST /plans: what a bake would come to."""

from __future__ import annotations

from farfield_core.choice import choose
from farfield_core.plan import Plan
from fastapi import APIRouter, Depends

from farfield_api.dependencies import Service, known_scene_in_body
from farfield_api.exceptions import problems
from farfield_api.schemas import BakeRequest

router = APIRouter(tags=["plans"])


@router.post(
    "/plans", responses=problems(404, 409, 422), dependencies=[Depends(known_scene_in_body)]
)
def make_plan(service: Service, request: BakeRequest) -> Plan:
    """Estimate cells, near field, megabytes and seconds; nothing is rendered or kept."""
    scene = service.ready_scene(request.scene)
    corridor = service.corridor(request.scene, request.corridor)
    return choose(scene, corridor, request.settings).plan
