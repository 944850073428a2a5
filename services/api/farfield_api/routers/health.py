"""GET /health: the process lives; GET /ready: it can serve; GET /metrics: what it counts."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Request
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from pydantic import BaseModel

from farfield_api import __version__
from farfield_api.dependencies import Service
from farfield_api.exceptions import problem, problems

router = APIRouter(tags=["health"])
metrics_router = APIRouter(include_in_schema=False)


class Health(BaseModel):
    """That the server serves, and what it is."""

    status: Literal["ok"] = "ok"
    version: str = __version__
    #: who bakes: this server itself, or a farm
    dispatch: Literal["local", "farm"]


@router.get("/health")
def health(service: Service) -> Health:
    """Answer as soon as the server can serve."""
    return Health(dispatch="farm" if service.settings.broker else "local")


@router.get("/ready", responses=problems(503), response_model=Health)
def ready(request: Request, service: Service) -> Health | Response:
    """Answer 200 where the store can be reached and the server is not about to stop."""
    if request.app.state.stopping:
        return problem(503, "The server is about to stop; ask another one.")
    service.store.exists("ready")
    return Health(dispatch="farm" if service.settings.broker else "local")


@metrics_router.get("/metrics")
def metrics(request: Request) -> Response:
    """Get all numbers in Prometheus's format."""
    return Response(
        generate_latest(request.app.state.metrics.registry), media_type=CONTENT_TYPE_LATEST
    )
