"""Files that never change once they exist: long-lived cache headers, ETag, 304 and ranges."""

from __future__ import annotations

import hashlib
import mimetypes
from pathlib import Path

from farfield_core.store import Store
from fastapi import Request
from fastapi.responses import FileResponse, Response

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
        return Response(store.get(key), 200, headers, media_type)
    return FileResponse(Path(path), 200, headers, media_type)
