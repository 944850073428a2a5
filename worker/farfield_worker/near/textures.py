"""Textures of near blocks: the scene's PNG files, reduced to what a near view needs."""

from __future__ import annotations

import hashlib
import io
from pathlib import Path

from PIL import Image

#: longest side of a texture that a browser is sent
LARGEST = 2048


def near_texture(path: Path) -> tuple[str, bytes]:
    """Name (hash and suffix) and bytes of the texture at `path` for near blocks."""
    with Image.open(path) as image:
        longest = max(image.size)
        if longest <= LARGEST:
            data = path.read_bytes()
        else:
            width, height = (max(1, round(side * LARGEST / longest)) for side in image.size)
            out = io.BytesIO()
            image.resize((width, height), Image.Resampling.BOX).save(out, "PNG", compress_level=6)
            data = out.getvalue()
    return hashlib.sha256(data).hexdigest()[:32] + ".png", data
