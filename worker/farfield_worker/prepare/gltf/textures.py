"""glTF textures, samplers and images, with KHR_texture_transform and EXT_texture_webp."""

from __future__ import annotations

import math
from typing import Any

from farfield_worker.prepare.gltf.accessors import Accessors
from farfield_worker.prepare.gltf.document import Json, data_uri
from farfield_worker.prepare.images import Picture, UnreadablePictureError, measure
from farfield_worker.prepare.model import TextureUse, Wrap

_WRAPS: dict[int, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_NEAREST = 9728


class Textures:
    """Reads texture references of one document; what is missing becomes a note and None."""

    def __init__(self, accessors: Accessors) -> None:
        self.accessors = accessors
        self.document = accessors.document
        self._pictures: dict[int, Picture | None] = {}
        self._pixels = 0

    def use(self, info: Any) -> TextureUse | None:
        """Resolve a textureInfo object (or None)."""
        if not isinstance(info, dict):
            return None
        entry = self.document.item("textures", info.get("index"))
        extensions = entry.get("extensions", {})
        source = extensions.get("EXT_texture_webp", {}).get("source", entry.get("source"))
        if source is None:
            self.document.note("A texture in a format that is not supported was left out.")
            return None
        picture = self._picture(source)
        if picture is None:
            return None
        sampler: Json = {}
        if "sampler" in entry:
            sampler = self.document.item("samplers", entry["sampler"])
        transform = info.get("extensions", {}).get("KHR_texture_transform", {})
        return TextureUse(
            picture,
            _WRAPS.get(sampler.get("wrapS", 10497), "repeat"),
            _WRAPS.get(sampler.get("wrapT", 10497), "repeat"),
            "nearest" if sampler.get("magFilter") == _NEAREST else "linear",
            int(transform.get("texCoord", info.get("texCoord", 0))),
            _matrix(transform),
        )

    def _picture(self, index: int) -> Picture | None:
        if index not in self._pictures:
            self._pictures[index] = self._load(index)
        return self._pictures[index]

    def _load(self, index: int) -> Picture | None:
        entry = self.document.item("images", index)
        name = str(entry.get("name") or entry.get("uri") or f"image {index}")[:80]
        if "bufferView" in entry:
            picture = Picture(name, self.accessors.view(entry["bufferView"])[0].tobytes())
        elif str(entry.get("uri", "")).startswith("data:"):
            picture = Picture(f"image {index}", data_uri(self.document, entry["uri"]))
        else:
            path = self.document.folder.find(str(entry.get("uri", "")), is_uri=True)
            if path is None:
                self.document.note(f"The texture {name!r} is missing.")
                return None
            picture = Picture(name, path)
        try:
            self._pixels += measure(picture, self.document.folder.name, self.document.limits)
        except UnreadablePictureError:
            self.document.note(f"The texture {picture.name!r} cannot be read.")
            return None
        if self._pixels > self.document.limits.picture_pixels:
            self.document.refuse("its textures have too many pixels; reduce them")
        return picture


def _matrix(
    transform: Json,
) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    # KHR_texture_transform: translation * rotation * scale
    if not any(key in transform for key in ("offset", "rotation", "scale")):
        return None
    du, dv = (float(x) for x in transform.get("offset", (0, 0)))
    su, sv = (float(x) for x in transform.get("scale", (1, 1)))
    angle = float(transform.get("rotation", 0))
    c, s = math.cos(angle), math.sin(angle)
    return (c * su, s * sv, du), (-s * su, c * sv, dv)
