"""The built pages: hashed assets are cached for ever, everything else is asked for anew."""

from __future__ import annotations

from pathlib import Path

from fastapi import FastAPI
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import HTMLResponse
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match, Mount
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

NOT_BUILT = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Farfield</title>
<p>The server runs, but its pages are not built.
Run <code>make setup</code>, or set <code>FARFIELD_WEB</code> to a folder that holds them.
<p>The API is at <a href="/api/v1/openapi.json">/api/v1/openapi.json</a>.</html>
"""


class Pages(StaticFiles):
    """One page for every address a browser may open, beside the files it is built of."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Answer with a file, or for addresses such as /walk/<id> with the page that knows them."""
        try:
            response = await super().get_response(path, scope)
        except HTTPException as error:
            if error.status_code != 404 or "." in path.rpartition("/")[2]:
                raise
            own = f"{path.partition('/')[0]}/index.html"
            known = await run_in_threadpool(self.lookup_path, own)
            response = await super().get_response(own if known[1] else "index.html", scope)
        hashed = path.startswith("assets/") and response.status_code in (200, 206, 304)
        response.headers["Cache-Control"] = (
            "public, max-age=31536000, immutable" if hashed else "no-cache"
        )
        return response


class PagesMount(Mount):
    """Everything outside the API, which answers for its own addresses and methods."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Never match what belongs to the API."""
        if scope["path"].removeprefix(scope.get("root_path", "")).startswith("/api/"):
            return Match.NONE, {}
        return super().matches(scope)


async def _not_built() -> Response:
    return HTMLResponse(NOT_BUILT, 503, headers={"Cache-Control": "no-store"})


def install(app: FastAPI, folder: Path) -> None:
    """Serve the pages in `folder` at every address that no route takes."""
    if (folder / "index.html").is_file():
        app.router.routes.append(PagesMount("/", Pages(directory=folder, html=True), name="pages"))
    else:
        app.add_api_route("/", _not_built, include_in_schema=False)
        app.add_api_route("/walk/{bake}", _not_built, include_in_schema=False)
