"""What routes ask for."""

from __future__ import annotations

import contextlib
import json
from typing import Annotated, cast

from fastapi import Depends, Request
from fastapi.concurrency import run_in_threadpool

from farfield_api.names import IS_ID, SceneId
from farfield_api.service import FarfieldService


def _service(request: Request) -> FarfieldService:
    return cast(FarfieldService, request.app.state.service)


Service = Annotated[FarfieldService, Depends(_service)]


def known_scene(service: Service, scene: SceneId) -> None:
    """Answer 404 before a body is looked at."""
    service.scenes.describe(scene)


async def known_scene_in_body(request: Request, service: Service) -> None:
    """Likewise where the body names the scene; what is wrong with it otherwise is told later."""
    with contextlib.suppress(ValueError, AttributeError, RecursionError):
        scene = json.loads(await request.body()).get("scene")
        if isinstance(scene, str) and IS_ID.fullmatch(scene):
            await run_in_threadpool(service.scenes.describe, scene)
