"""/scenes: models, and corridors through them."""

from __future__ import annotations

from typing import Annotated, Literal

from farfield_core import layout
from farfield_core.corridor import Corridor, cut
from farfield_core.scenes import Orientation
from farfield_core.settings import BakeSettings
from fastapi import APIRouter, Body, Depends, Path, Query, Request
from fastapi.responses import Response

from farfield_api import immutable
from farfield_api.dependencies import Service, known_scene
from farfield_api.exceptions import problems
from farfield_api.listing import Cursor, Limit, page
from farfield_api.names import PreparedName, SceneId
from farfield_api.scenes import Described
from farfield_api.schemas import (
    BOX,
    PATH,
    NewCorridor,
    NewScene,
    SceneBody,
    SceneList,
    SuggestionBody,
)

router = APIRouter(prefix="/scenes", tags=["scenes"])

#: pictures of a scene never change, as its id is a hash of the model
_PICTURE = {200: {"content": {"image/png": {}}}, **problems(404, 409, 422)}


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
        orientation=scene.orientation,
        suspected=info.suspected if info else None,
        map=info.map if info else None,
    )


@router.get("", responses=problems(422))
def scenes(
    service: Service,
    limit: Limit = 100,
    cursor: Cursor = None,
    state: Literal["preparing", "ready", "refused"] | None = None,
    name: Annotated[
        str | None, Query(max_length=100, description="Part of a scene's name.")
    ] = None,
) -> SceneList:
    """List scenes."""

    def find(scene: str) -> SceneBody | None:
        found = service.scenes.describe(scene)
        if state is not None and found.state != state:
            return None
        if name is not None and name.casefold() not in found.name.casefold():
            return None
        return _body(found)

    found, following = page(service.scenes.ids(), cursor, limit, find)
    return SceneList(scenes=found, next=following)


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


@router.get("/{scene}/map.png", response_class=Response, responses=_PICTURE)
def scene_map(request: Request, service: Service, scene: SceneId) -> Response:
    """Get the scene from above; `map` of the scene says which rectangle of ground it shows."""
    return _picture(request, service, scene, "map.png")


@router.get("/{scene}/thumbnail.png", response_class=Response, responses=_PICTURE)
def scene_thumbnail(request: Request, service: Service, scene: SceneId) -> Response:
    """Get a small picture of the scene."""
    return _picture(request, service, scene, "thumbnail.png")


def _picture(request: Request, service: Service, scene: str, name: str) -> Response:
    service.ready_scene(scene)
    data = service.store.get(f"{layout.prepared_prefix(scene)}{name}")
    return immutable.content(request, data, "image/png")


@router.get("/{scene}/suggestion", responses=problems(404, 409, 422))
def suggestion(service: Service, scene: SceneId) -> SuggestionBody:
    """Get a short walk in a good place of the scene."""
    found = service.suggestion(scene)
    return SuggestionBody(
        corridor=found.corridor, cell_size=found.cell_size, eye_height=found.corridor.eye_height
    )


@router.post(
    "/{scene}/orientation",
    status_code=201,
    responses=problems(404, 409, 422),
    dependencies=[Depends(known_scene)],
)
def reorient(service: Service, scene: SceneId, orientation: Orientation) -> NewScene:
    """Read the same model with another axis up or in another unit: a scene of its own."""
    turned = service.scenes.reorient(scene, orientation)
    return NewScene(id=turned, state=service.scenes.describe(turned).state)


@router.get("/{scene}/corridors/{corridor}", responses=problems(404, 422))
def corridor(
    service: Service, scene: SceneId, corridor: Annotated[str, Path(pattern=r"^[0-9a-f]{16}$")]
) -> Corridor:
    """Get a corridor that was kept."""
    return service.corridor(scene, corridor)


@router.post(
    "/{scene}/corridors",
    status_code=201,
    responses=problems(404, 409, 422),
    dependencies=[Depends(known_scene)],
)
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
