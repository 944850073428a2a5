"""GET /health."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel, Field

from farfield_api import __version__
from farfield_api.dependencies import Service

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """The server can serve."""

    status: str = "ok"
    version: str = Field(examples=["0.1.0"])
    #: "local" where this server bakes by itself, "farm" where workers do
    dispatch: str = Field(examples=["local"])


@router.get("/health")
def health(service: Service) -> Health:
    """Whether this server can serve: it answers, and its store can be asked."""
    service.store.exists("health")
    return Health(version=__version__, dispatch="farm" if service.settings.broker else "local")
