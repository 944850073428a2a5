"""The application: routes, errors and pages around one service."""

from __future__ import annotations

import logging
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from threading import Thread

from farfield_core.dispatch import Dispatcher, Listener
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.dispatch.prepare import ScenePreparer
from farfield_core.store import Store
from fastapi import FastAPI
from fastapi.middleware.cors import CORSMiddleware
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.routing import APIRoute
from starlette.types import Scope

from farfield_api import __version__, exceptions, pages
from farfield_api.auth import Auth, OwnPages
from farfield_api.idempotency import Idempotency
from farfield_api.keys import Keys
from farfield_api.limits import BodyLimit
from farfield_api.observe import Metrics, Observe, Tracing, cell_listener
from farfield_api.routers import (
    bakes,
    events,
    farm,
    health,
    keys,
    plans,
    scenes,
    tus,
    uploads,
    walks,
)
from farfield_api.routers.tus import TusHeaders
from farfield_api.service import FarfieldService
from farfield_api.settings import ApiSettings

log = logging.getLogger("farfield")

PREFIX = "/api/v1"

#: headers that pages of other origins may read
EXPOSED = [
    "Location",
    "ETag",
    "Tus-Resumable",
    "Upload-Offset",
    "Upload-Length",
    "Upload-Expires",
    "Idempotency-Replayed",
    "X-Request-Id",
]

#: greatest size of a request that is not an upload, bytes
BODY_LIMIT = 16 * 1024**2


def create_service(settings: ApiSettings) -> FarfieldService:
    """Make what `settings` ask for: a server that bakes itself, or one that feeds a farm."""
    store = Store.open(settings.store)
    if settings.broker:
        # imported here, because a server without a farm needs no Celery
        from farfield_core.dispatch.celery import CeleryDispatcher  # noqa: PLC0415
        from farfield_core.dispatch.celery_prepare import CeleryPreparer  # noqa: PLC0415

        def farm(listener: Listener) -> Dispatcher:
            return CeleryDispatcher(store, settings.broker, listener, device=settings.device)

        return FarfieldService(settings, store, farm, CeleryPreparer(store, settings.broker))

    def local(listener: Listener) -> Dispatcher:
        return LocalDispatcher(store, settings.jobs, listener)

    preparer = ScenePreparer(store, limits=settings.prepare_limits)
    return FarfieldService(settings, store, local, preparer)


def create_app(
    settings: ApiSettings,
    service: FarfieldService | None = None,
    tracing: Tracing | None = None,
) -> FastAPI:
    """Build the application; `service` and `tracing` are made from `settings` unless given."""
    metrics, tracing = Metrics(), tracing or Tracing(settings.traces)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        running = service or create_service(settings)
        app.state.service = running
        app.state.stopping = False
        running.bakes.listeners.append(cell_listener(metrics, tracing))
        if settings.needs_keys and not running.keys.list():
            _, secret = running.keys.create("first", "admin")
            log.warning("There was no key; this one may do everything: %s", secret)
        # Reading a large store takes a while, and the server can serve meanwhile.
        taking_up = Thread(target=running.take_up, name="farfield-take-up", daemon=True)
        taking_up.start()
        yield
        running.close()
        taking_up.join()
        tracing.close()

    app = FastAPI(
        title="Farfield",
        version=__version__,
        summary="Upload a model, bake a corridor, walk through it.",
        lifespan=lifespan,
        openapi_url=f"{PREFIX}/openapi.json",
        # Their pages load scripts from elsewhere.
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=_operation,
    )
    app.state.metrics, app.state.tracing = metrics, tracing
    # Each is inside the ones that are added after it.
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=6)
    app.add_middleware(Idempotency)
    app.add_middleware(TusHeaders, prefix=f"{PREFIX}/uploads")
    app.add_middleware(OwnPages, origins=settings.origins)
    if settings.needs_keys:
        app.add_middleware(Auth, prefix=PREFIX, keys=_keys, rate=settings.rate)
    app.add_middleware(
        BodyLimit,
        limit=BODY_LIMIT,
        others={
            f"{PREFIX}/scenes": settings.upload_limit,
            f"{PREFIX}/uploads": settings.resumable_limit,
            f"{PREFIX}/uploads/": settings.resumable_limit,
        },
    )
    if settings.origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.origins,
            allow_methods=["GET", "HEAD", "POST", "PATCH", "DELETE", "OPTIONS"],
            allow_headers=["*"],
            expose_headers=EXPOSED,
            max_age=600,
        )
    app.add_middleware(Observe, metrics=metrics, tracing=tracing)
    exceptions.install(app)
    for module in (health, scenes, uploads, tus, plans, bakes, events, walks, farm, keys):
        app.include_router(module.router, prefix=PREFIX)
    app.include_router(health.metrics_router)
    pages.install(app, settings.web)
    return app


def create_app_from_environment() -> FastAPI:
    """Build the application as a server of its own starts it."""
    return create_app(ApiSettings.from_environment(os.environ))


def _keys(scope: Scope) -> Keys:
    found: Keys = scope["app"].state.service.keys
    return found


def _operation(route: APIRoute) -> str:
    return route.name
