"""Files that never change once they exist: long-lived cache headers, ETag, 304 and ranges."""

from __future__ import annotations

import hashlib
import mimetypes
import re
from pathlib import Path

from farfield_core.store import Store
from fastapi import Request
from fastapi.responses import FileResponse, Response

from farfield_api.packed import Coding

FOREVER = "public, max-age=31536000, immutable"

mimetypes.add_type("model/gltf-binary", ".glb")
mimetypes.add_type("image/webp", ".webp")
mimetypes.add_type("image/ktx2", ".ktx2")


def _unchanged(request: Request, etag: str) -> bool:
    """Whether the client has this very version (RFC 9110, 13.1.2: weak comparison)."""
    sent = request.headers.get("if-none-match", "")
    known = {tag.strip().removeprefix("W/") for tag in sent.split(",")}
    return "*" in known or etag.removeprefix("W/") in known


def content(request: Request, data: bytes, media_type: str, cache: str = FOREVER) -> Response:
    """Answer with `data`, whose ETag is its hash; weak, because it may be sent compressed."""
    etag = f'W/"{hashlib.sha256(data).hexdigest()[:32]}"'
    headers = {"ETag": etag, "Cache-Control": cache}
    if _unchanged(request, etag):
        return Response(None, 304, headers)
    return Response(data, 200, headers, media_type)


def packed(request: Request, name: str, data: bytes, coding: Coding) -> Response:
    """Answer with an object in one of its forms, each with an ETag of its own (RFC 9110, 8.8.3.3).

    `name` is the object's key: nothing that has a key ever changes.
    """
    etag = f'"{hashlib.sha256(name.encode()).hexdigest()[:24]}-{coding}"'
    headers = {"ETag": etag, "Cache-Control": FOREVER, "Vary": "Accept-Encoding"}
    if _unchanged(request, etag):
        return Response(None, 304, headers)
    # always said, so that nothing compresses it once more
    if coding != "identity":
        headers["Content-Encoding"] = coding
    return Response(data, 200, headers, mimetypes.guess_type(name)[0])


def blob(request: Request, store: Store, key: str) -> Response:
    """Answer with a stored object whose name is its hash; raises NotFoundError."""
    return stored(request, store, key, key.rsplit("/", 1)[-1].partition(".")[0])


def stored(request: Request, store: Store, key: str, tag: str) -> Response:
    """Answer with a stored object that never changes; `tag` tells it from all others.

    A store that is a folder also answers ranges. Raises NotFoundError.
    """
    headers = {"ETag": f'"{tag}"', "Cache-Control": FOREVER}
    media_type = mimetypes.guess_type(key)[0] or "application/octet-stream"
    store.size(key)
    if _unchanged(request, headers["ETag"]):
        return Response(None, 304, headers)
    path = store.local_path(key)
    if path is None:
        return _part(request, store, key, headers, media_type)
    return FileResponse(Path(path), 200, headers, media_type)


_RANGE = re.compile(r"^bytes=(\d{1,18})-(\d{0,18})$")


def _part(
    request: Request, store: Store, key: str, headers: dict[str, str], media_type: str
) -> Response:
    """Answer from a store that is no folder: the one range asked for, else everything."""
    headers["Accept-Ranges"] = "bytes"
    asked = _RANGE.match(request.headers.get("range", ""))
    conditional = request.headers.get("if-range", headers["ETag"])
    if asked is None or conditional != headers["ETag"] or request.method == "HEAD":
        return Response(store.get(key), 200, headers, media_type)
    size, first = store.size(key), int(asked[1])
    last = min(int(asked[2] or size - 1), size - 1)
    if first >= size or last < first:
        return Response(None, 416, headers | {"Content-Range": f"bytes */{size}"})
    headers["Content-Range"] = f"bytes {first}-{last}/{size}"
    return Response(store.get_range(key, first, last + 1), 206, headers, media_type)
