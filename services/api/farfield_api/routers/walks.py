"""/walks: what a viewer reads. Everything that exists is immutable."""

from __future__ import annotations

from typing import Annotated

from farfield_core import layout
from farfield_core.bake import relocate
from farfield_core.cells import parse_cell_name
from farfield_core.errors import NotFoundError
from farfield_core.walk import Places
from fastapi import APIRouter, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response

from farfield_api import immutable
from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.names import BakeId, BlobName, CellName, PageNumber
from farfield_api.packed import Coding, choose
from farfield_api.schemas import CellNames

router = APIRouter(prefix="/walks/{bake}", tags=["walks"], responses=problems(404, 422))

#: blobs are shared between bakes in the store, but look like each walk's own from outside
PLACES = Places(cells="cells/", atlases="atlases/", near="near/")

_JSON = "application/json"


@router.head("/walk.json", include_in_schema=False)
@router.get("/walk.json", response_class=Response)
def manifest(request: Request, service: Service, bake: BakeId) -> Response:
    """Get the manifest, its places relative to this address (docs/format.md)."""
    walk = relocate(service.bakes.walk(bake), PLACES)
    return immutable.content(request, walk.model_dump_json().encode(), _JSON)


@router.head("/pages/{page}.json", include_in_schema=False)
@router.get("/pages/{page}.json", response_class=Response)
def cell_table(request: Request, service: Service, bake: BakeId, page: PageNumber) -> Response:
    """Get a slice of a large corridor's cell table."""
    return _json(request, service, f"{layout.bake_prefix(bake)}pages/{page}.json")


@router.head("/cells/{cell}.json", include_in_schema=False)
@router.get("/cells/{cell}.json", response_class=Response)
async def cell(request: Request, service: Service, bake: BakeId, cell: CellName) -> Response:
    """Get a cell; 404 while it is not baked, which also moves it to the front."""
    index = parse_cell_name(cell)
    key, coding = layout.cell_key(bake, index), _coding(request)
    data = service.packed.recent(key, coding)
    if data is None:
        data = await run_in_threadpool(_find, service, bake, cell, key, coding)
    return immutable.packed(request, key, data, coding)


def _coding(request: Request) -> Coding:
    return choose(request.headers.get("accept-encoding", ""))


def _json(request: Request, service: Service, key: str) -> Response:
    coding = _coding(request)
    return immutable.packed(request, key, service.packed.get(key, coding), coding)


def _find(service: Service, bake: str, cell: str, key: str, coding: Coding) -> bytes:
    try:
        return service.packed.get(key, coding)
    except NotFoundError:
        service.bakes.hint(bake, parse_cell_name(cell))
        raise NotFoundError(f"Cell {cell} of walk {bake} is not baked; ask again later.") from None


@router.get("/cells")
def cells(
    service: Service,
    bake: BakeId,
    page: Annotated[
        str, Query(pattern=r"^\d{1,9}$", description="`next` of the page before.")
    ] = "0",
) -> CellNames:
    """List the cells that exist."""
    names, following = service.bakes.done_page(bake, int(page))
    return CellNames(cells=names, next=None if following is None else str(following))


@router.head("/atlases/{name}", include_in_schema=False)
@router.get("/atlases/{name}", response_class=Response)
def atlas(request: Request, service: Service, bake: BakeId, name: BlobName) -> Response:
    """Get an atlas page."""
    return immutable.blob(request, service.store, layout.atlas_key(name))


@router.head("/near/{name}", include_in_schema=False)
@router.get("/near/{name}", response_class=Response)
def near(request: Request, service: Service, bake: BakeId, name: BlobName) -> Response:
    """Get a near block, or a texture of one."""
    key, coding = layout.near_key(name), _coding(request)
    # whoever asks for a part counts in the bytes of the file itself
    if not name.endswith(".glb") or coding == "identity" or "range" in request.headers:
        return immutable.blob(request, service.store, key)
    return immutable.packed(request, key, service.packed.get(key, coding), coding)
