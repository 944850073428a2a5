"""/scenes: models, and corridors through them."""

from __future__ import annotations

from typing import Annotated

from farfield_core import layout
from farfield_core.corridor import Corridor, cut
from farfield_core.settings import BakeSettings
from fastapi import APIRouter, Body, Request
from fastapi.responses import Response

from farfield_api import immutable
from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.names import PreparedName, SceneId
from farfield_api.scenes import Described
from farfield_api.schemas import BOX, PATH, NewCorridor, SceneBody, SceneList

router = APIRouter(prefix="/scenes", tags=["scenes"])


def _body(scene: Described) -> SceneBody:
    info = scene.info
    return SceneBody(
        id=scene.id,
        name=scene.name,
        state=scene.state,
        reason=scene.reason,
        bounds=info.bounds if info else None,
        triangles=info.triangles if info else None,
        textures=len(info.textures) if info else None,
        notes=info.notes if info else (),
    )


@router.get("")
def scenes(service: Service) -> SceneList:
    """List all scenes."""
    known = service.scenes
    return SceneList(scenes=[_body(known.describe(scene)) for scene in known.ids()])


@router.get("/{scene}", responses=problems(404, 422))
def scene(service: Service, scene: SceneId) -> SceneBody:
    """Get a scene, and how far it has come."""
    return _body(service.scenes.describe(scene))


@router.head("/{scene}/prepared/{file:path}", include_in_schema=False)
@router.get("/{scene}/prepared/{file:path}", response_class=Response, responses=problems(404, 422))
def prepared(request: Request, service: Service, scene: SceneId, file: PreparedName) -> Response:
    """Get a file of the prepared scene: the model itself, or a picture of it."""
    service.ready_scene(scene)
    return immutable.stored(
        request, service.store, layout.prepared_prefix(scene) + file, f"{scene}-{file}"
    )


@router.post("/{scene}/corridors", status_code=201, responses=problems(404, 409, 422))
def add_corridor(
    service: Service,
    scene: SceneId,
    corridor: Annotated[
        Corridor,
        Body(openapi_examples={"box": {"value": BOX}, "path": {"value": PATH}}),
    ],
) -> NewCorridor:
    """Keep a corridor, so that plans and bakes can name it."""
    service.ready_scene(scene)
    grid = cut(corridor, BakeSettings().cell_size, service.ground(scene, corridor))
    return NewCorridor(id=service.add_corridor(scene, corridor), cells=len(grid))
