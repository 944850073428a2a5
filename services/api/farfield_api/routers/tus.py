"""/uploads: resumable uploads by tus 1.0 (core, creation, with-upload, termination, expiration,
checksum; https://tus.io/protocols/resumable-upload).

Beside the protocol, GET tells what has become of an upload: the scene it was made into.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import contextlib
import hashlib
from email.utils import formatdate
from http import HTTPStatus
from typing import Annotated, Any, BinaryIO

from fastapi import APIRouter, Header, Path, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from farfield_api.dependencies import Service
from farfield_api.exceptions import problems
from farfield_api.keys import owner_of
from farfield_api.schemas import UploadBody
from farfield_api.uploads import Upload, sync

VERSION = "1.0.0"
EXTENSIONS = "creation,creation-with-upload,termination,expiration,checksum"
ALGORITHMS = ("sha1", "sha256", "md5", "crc32")
#: bytes gathered before they are written
BLOCK = 1 << 20
#: seconds without a byte after which a connection is given up, so that its upload can go on
IDLE = 30.0
#: longest Upload-Metadata, characters
METADATA = 4096

_CHECKSUM_MISMATCH = 460

router = APIRouter(prefix="/uploads", tags=["uploads"])

UploadId = Annotated[
    str, Path(pattern=r"^[0-9a-f]{32}$", description="An upload's id, from its Location.")
]
Resumable = Annotated[
    # anything else is answered with 412, as tus has it, not with 422
    str | None, Header(alias="Tus-Resumable", include_in_schema=False)
]
Offset = Annotated[
    str,
    Header(
        alias="Upload-Offset", pattern=r"^\d{1,15}$", description="Where to go on.", examples=["0"]
    ),
]
Checksum = Annotated[
    str | None,
    Header(
        alias="Upload-Checksum",
        description="Algorithm and Base64 digest of this request's body.",
        examples=["sha1 2jmj7l5rSw0yVb/vlWAYkK/YBwk="],
    ),
]
_HEADERS: dict[str, Any] = {
    "Upload-Offset": {"schema": {"type": "string"}, "description": "Bytes that have arrived."},
    "Upload-Expires": {"schema": {"type": "string"}, "description": "When it is forgotten."},
}
# The bodies are not described: few tools know their media type, and a schema says nothing of bytes.
_SAID: dict[str, Any] = {
    "parameters": [
        {
            "name": "Tus-Resumable",
            "in": "header",
            "required": True,
            "schema": {"type": "string", "enum": [VERSION]},
        }
    ]
}


class TusHeaders:
    """ASGI middleware: every answer below `prefix` says which protocol it speaks."""

    def __init__(self, app: ASGIApp, prefix: str) -> None:
        self._app = app
        self._prefix = prefix

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http" or not scope["path"].startswith(self._prefix):
            await self._app(scope, receive, send)
            return

        async def marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["Tus-Resumable"] = VERSION
            await send(message)

        await self._app(scope, receive, marked)


@router.options("", status_code=204, operation_id="upload_options")
def options(service: Service) -> Response:
    """Tell which version and extensions of tus are spoken."""
    return Response(
        None,
        204,
        {
            "Tus-Version": VERSION,
            "Tus-Extension": EXTENSIONS,
            "Tus-Max-Size": str(service.settings.resumable_limit),
            "Tus-Checksum-Algorithm": ",".join(ALGORITHMS),
        },
    )


@router.post(
    "",
    status_code=201,
    response_class=Response,
    responses={
        201: {"headers": {"Location": {"schema": {"type": "string"}}, **_HEADERS}},
        **problems(409, 412, 413, 422, 423, 507),
    },
    openapi_extra=_SAID,
    operation_id="create_upload",
)
async def create(
    request: Request,
    service: Service,
    upload_length: Annotated[
        str,
        Header(alias="Upload-Length", pattern=r"^\d{1,15}$", description="Bytes.", examples=["42"]),
    ],
    upload_metadata: Annotated[
        str,
        Header(
            alias="Upload-Metadata",
            max_length=METADATA,
            description="As tus has it; `filename` in Base64 is needed.",
            examples=["filename dG93bi5nbGI="],
        ),
    ],
    tus_resumable: Resumable = None,
    content_type: Annotated[str, Header(include_in_schema=False)] = "",
    upload_checksum: Checksum = None,
) -> Response:
    """Begin an upload; the answer's Location is where its bytes go."""
    _check_version(tus_resumable)
    length = int(upload_length)
    limit = service.settings.resumable_limit
    if length > limit:
        raise HTTPException(413, f"The file has {length} bytes; this server takes {limit}.")
    name = metadata(upload_metadata).get("filename", "")
    upload = await run_in_threadpool(
        service.uploads.create, name, length, upload_metadata, owner_of(request)
    )
    headers = {"Location": service.settings.link(f"/api/v1/uploads/{upload.id}")}
    if content_type == "application/offset+octet-stream":
        await _append(request, service, upload, 0, upload_checksum)
        headers["Upload-Offset"] = str(service.uploads.offset(upload))
    return Response(None, 201, headers | _expires(service, upload))


@router.head(
    "/{upload}",
    operation_id="head_upload",
    responses=problems(404, 410, 412, 422),
    openapi_extra=_SAID,
)
def head(service: Service, upload: UploadId, tus_resumable: Resumable = None) -> Response:
    """Tell how many bytes have arrived."""
    _check_version(tus_resumable)
    found = service.uploads.get(upload)
    headers = {
        "Upload-Offset": str(service.uploads.offset(found)),
        "Upload-Length": str(found.length),
        "Upload-Metadata": found.metadata,
        "Cache-Control": "no-store",
    }
    return Response(None, 200, headers | _expires(service, found))


@router.get("/{upload}", operation_id="get_upload", responses=problems(404, 410, 422))
def get(service: Service, upload: UploadId) -> UploadBody:
    """Get what has become of an upload."""
    found = service.uploads.get(upload)
    return UploadBody(
        id=found.id,
        name=found.name,
        length=found.length,
        offset=service.uploads.offset(found),
        state=service.uploads.state(found),
        scene=found.scene,
        reason=found.reason,
    )


@router.patch(
    "/{upload}",
    status_code=204,
    responses={204: {"headers": _HEADERS}, **problems(404, 409, 410, 412, 413, 415, 422, 423, 507)},
    openapi_extra=_SAID,
    operation_id="append_to_upload",
)
async def append(
    request: Request,
    service: Service,
    upload: UploadId,
    upload_offset: Offset,
    tus_resumable: Resumable = None,
    content_type: Annotated[str, Header(include_in_schema=False)] = "",
    upload_checksum: Checksum = None,
) -> Response:
    """Add the body, which is application/offset+octet-stream, to an upload.

    What arrived before a connection broke stays, unless it has a checksum.
    """
    _check_version(tus_resumable)
    found = await run_in_threadpool(service.uploads.get, upload)
    if content_type != "application/offset+octet-stream":
        raise HTTPException(415, "The body has to be application/offset+octet-stream.")
    await _append(request, service, found, int(upload_offset), upload_checksum)
    headers = {"Upload-Offset": str(service.uploads.offset(found))}
    return Response(None, 204, headers | _expires(service, found))


@router.delete(
    "/{upload}",
    status_code=204,
    openapi_extra=_SAID,
    operation_id="delete_upload",
    responses=problems(404, 410, 412, 422, 423),
)
def delete(service: Service, upload: UploadId, tus_resumable: Resumable = None) -> Response:
    """Take an upload back; a scene that was made of it stays."""
    _check_version(tus_resumable)
    found = service.uploads.get(upload)
    release = service.uploads.hold(found)
    if release is None:
        raise _held(upload)
    try:
        service.uploads.delete(found)
    finally:
        release()
    return Response(None, 204)


def metadata(text: str) -> dict[str, str]:
    """Read Upload-Metadata: pairs of a key and a Base64 value, separated by commas."""
    found: dict[str, str] = {}
    for pair in text.split(","):
        key, _, value = pair.strip().partition(" ")
        try:
            found[key] = base64.b64decode(value.strip(), validate=True).decode("utf-8")
        except (binascii.Error, ValueError):
            raise HTTPException(
                422, f"Upload-Metadata: the value of {key[:40]!r} is no UTF-8 in Base64."
            ) from None
    return found


async def _append(
    request: Request, service: Service, upload: Upload, offset: int, checksum: str | None
) -> None:
    """Write a request's body behind what is there, in blocks, so that memory stays small."""
    release = service.uploads.hold(upload)
    if release is None:
        raise _held(upload.id)
    try:
        here = service.uploads.offset(upload)
        if offset != here:
            raise HTTPException(409, f"The upload is at byte {here}, not {offset}; go on there.")
        if offset == upload.length:
            return  # nothing is missing, and nothing can come
        digest, wanted = _digest(checksum)
        file = service.uploads.open(upload)
        with file:
            end = await _receive(request, file, upload, offset, digest)
            if digest is not None and digest.digest() != wanted:
                await run_in_threadpool(file.truncate, offset)
                raise HTTPException(
                    _CHECKSUM_MISMATCH, "The bytes do not have the checksum sent; send them again."
                )
            await run_in_threadpool(sync, file)
    finally:
        release()
    if end == upload.length:
        service.uploads.completed(upload)


async def _receive(
    request: Request, file: BinaryIO, upload: Upload, offset: int, digest: Any
) -> int:
    """Write what arrives; returns where it ends."""
    at = offset
    block = bytearray()

    async def write() -> None:
        nonlocal at
        data = bytes(block)
        block.clear()
        if digest is not None:
            digest.update(data)
        await run_in_threadpool(_write_at, file, at, data)
        at += len(data)

    whole = False
    try:
        async with asyncio.timeout(IDLE) as patience:
            async for chunk in request.stream():
                if at + len(block) + len(chunk) > upload.length:
                    raise HTTPException(
                        413, f"There are more bytes than the {upload.length} announced."
                    )
                block += chunk
                if len(block) >= BLOCK:
                    await write()
                patience.reschedule(asyncio.get_running_loop().time() + IDLE)
        whole = True
    except ClientDisconnect:
        raise HTTPException(400, "The connection broke; ask where to go on, and go on.") from None
    except TimeoutError:
        raise HTTPException(408, f"Nothing arrived for {IDLE:g} s; go on later.") from None
    finally:
        if whole or digest is None:
            await write()
        else:
            file.truncate(offset)
    return at


def _write_at(file: BinaryIO, at: int, data: bytes) -> None:
    view = memoryview(data)
    file.seek(at)
    while view:
        view = view[file.write(view) :]


def _digest(checksum: str | None) -> tuple[Any, bytes]:
    """The digest to compute, None without one, and what it should be."""
    if checksum is None:
        return None, b""
    name, _, value = checksum.partition(" ")
    if name not in ALGORITHMS:
        raise HTTPException(
            400, f"{name[:20]!r} is no checksum known here; use one of {', '.join(ALGORITHMS)}."
        )
    with contextlib.suppress(binascii.Error, ValueError):
        wanted = base64.b64decode(value, validate=True)
        return (_Crc32() if name == "crc32" else hashlib.new(name, usedforsecurity=False)), wanted
    raise HTTPException(400, "Upload-Checksum: the digest is not in Base64.")


class _Crc32:
    """CRC-32 with hashlib's interface."""

    def __init__(self) -> None:
        self._value = 0

    def update(self, data: bytes) -> None:
        self._value = binascii.crc32(data, self._value)

    def digest(self) -> bytes:
        return self._value.to_bytes(4, "big")


def _check_version(said: str | None) -> None:
    if said != VERSION:
        raise HTTPException(
            HTTPStatus.PRECONDITION_FAILED,
            f"The header Tus-Resumable has to be {VERSION}.",
            {"Tus-Version": VERSION},
        )


def _held(upload: str) -> HTTPException:
    return HTTPException(423, f"Another request is writing to upload {upload}; try again soon.")


def _expires(service: Service, upload: Upload) -> dict[str, str]:
    return {"Upload-Expires": formatdate(service.uploads.expires(upload), usegmt=True)}
