"""Atlas pages as files: PNG through libdeflate, or lossless WebP.

The PNG (ISO/IEC 15948) is put together here, from its filters and a deflate stream of libdeflate:
Pillow's own encoder takes five times as long for files no smaller.
"""

from __future__ import annotations

import io
import struct
import zlib

import deflate
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.compile.filters import filtered

#: libdeflate's effort, 1 to 12. Against 6, files of layered cells are 2.5 % smaller in 2.4 times as
#: long; 10 would make them 4 % smaller still in 3 times as long again.
LEVEL = 8

_RGBA = 6


def _chunk(kind: bytes, content: bytes | bytearray) -> bytes:
    checksum = zlib.crc32(content, zlib.crc32(kind))
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", checksum)


def png(page: NDArray[np.uint8]) -> bytes:
    """Encode an image (height, width, 4) uint8, straight alpha, bit for bit."""
    height, width, _ = page.shape
    rows = filtered(page.reshape(height, width * 4), 4)
    header = struct.pack(">IIBBBBB", width, height, 8, _RGBA, 0, 0, 0)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", deflate.zlib_compress(rows.data, LEVEL)),
            _chunk(b"IEND", b""),
        )
    )


def webp(page: NDArray[np.uint8]) -> bytes:
    """Encode an image (height, width, 4) uint8 losslessly, colours under alpha 0 included."""
    out = io.BytesIO()
    Image.fromarray(page, "RGBA").save(out, "WEBP", lossless=True, exact=True, quality=0, method=0)
    return out.getvalue()


#: suffix of the file and what writes it, by the walk's `encoding`
ENCODERS = {"png": (".png", png), "webp": (".webp", webp)}
