"""Textures of near blocks: the scene's PNG files, reduced to what a near view needs."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from PIL import Image

from farfield_worker.prepare.images import encode_png, shrink

#: longest side of a texture that a browser is sent
LARGEST = 2048


def near_texture(path: Path) -> tuple[str, bytes]:
    """Name (hash and suffix) and bytes of the texture at `path` for near blocks."""
    with Image.open(path) as image:
        if max(image.size) <= LARGEST:
            data = path.read_bytes()
        else:
            data = encode_png(shrink(np.asarray(image), LARGEST))
    return hashlib.sha256(data).hexdigest()[:32] + ".png", data
