"""The application: routes, errors and pages around one service."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from threading import Thread

from farfield_core.dispatch import Dispatcher, Listener
from farfield_core.dispatch.local import LocalDispatcher
from farfield_core.dispatch.prepare import ScenePreparer
from farfield_core.store import Store
from fastapi import FastAPI
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.routing import APIRoute

from farfield_api import __version__, exceptions, pages
from farfield_api.limits import BodyLimit
from farfield_api.routers import bakes, events, farm, health, plans, scenes, uploads, walks
from farfield_api.service import FarfieldService
from farfield_api.settings import ApiSettings

PREFIX = "/api/v1"

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

    return FarfieldService(settings, store, local, ScenePreparer(store))


def create_app(settings: ApiSettings, service: FarfieldService | None = None) -> FastAPI:
    """Build the application; `service` is made from `settings` unless given."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        running = service or create_service(settings)
        app.state.service = running
        app.state.stopping = False
        # Reading a large store takes a while, and the server can serve meanwhile.
        taking_up = Thread(target=running.take_up, name="farfield-take-up", daemon=True)
        taking_up.start()
        yield
        running.close()
        taking_up.join()

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
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=6)
    app.add_middleware(
        BodyLimit, limit=BODY_LIMIT, others={f"{PREFIX}/scenes": settings.upload_limit}
    )
    exceptions.install(app)
    for module in (health, scenes, uploads, plans, bakes, events, walks, farm):
        app.include_router(module.router, prefix=PREFIX)
    pages.install(app, settings.web)
    return app


def create_app_from_environment() -> FastAPI:
    """Build the application as a server of its own starts it."""
    return create_app(ApiSettings.from_environment(os.environ))


def _operation(route: APIRoute) -> str:
    return route.name
