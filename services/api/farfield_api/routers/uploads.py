"""POST /scenes: a model in one request. Starlette writes parts to disk as they arrive."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, File, UploadFile

from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.schemas import NewScene

router = APIRouter(tags=["scenes"])


@router.post("/scenes", status_code=201, responses=problems(413, 422))
def add_scene(
    service: Service,
    file: Annotated[UploadFile, File(description="A GLB, glTF, OBJ, PLY or STL file, or a zip.")],
) -> NewScene:
    """Send a model in one request. The same bytes give the same scene."""
    scene = service.scenes.add(file.filename or "", file.file, service.uploads.folder)
    return NewScene(id=scene, state=service.scenes.describe(scene).state)
