"""What routes ask for."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import Depends, Request

from farfield_api.service import FarfieldService


def _service(request: Request) -> FarfieldService:
    return cast(FarfieldService, request.app.state.service)


Service = Annotated[FarfieldService, Depends(_service)]
