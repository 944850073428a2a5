"""Textures of a scene or a near block on the GPU."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import moderngl
from PIL import Image

from farfield_worker.gl import context as gl

_SRGB8_ALPHA8 = 0x8C43

Wrap = Literal["repeat", "clamp", "mirror"]


def upload(
    context: moderngl.Context,
    image: Image.Image,
    wrap_u: Wrap = "repeat",
    wrap_v: Wrap = "repeat",
    filter_: Literal["linear", "nearest"] = "linear",
) -> moderngl.Texture:
    """Upload an sRGB image with straight alpha and all its mipmaps.

    The texture decodes to linear before filtering (SRGB8_ALPHA8), as in WebGL2; its mipmaps are
    built in linear light. Filters are glTF's LINEAR_MIPMAP_LINEAR and LINEAR, or
    NEAREST_MIPMAP_LINEAR and NEAREST.
    """
    pixels = image.convert("RGBA")
    texture = context.texture(pixels.size, 4, pixels.tobytes(), internal_format=_SRGB8_ALPHA8)
    texture.build_mipmaps()
    texture.filter = (
        (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        if filter_ == "linear"
        else (moderngl.NEAREST_MIPMAP_LINEAR, moderngl.NEAREST)
    )
    gl.set_wrap(texture, wrap_u, wrap_v)
    return texture


def upload_file(
    context: moderngl.Context,
    path: Path,
    wrap_u: Wrap,
    wrap_v: Wrap,
    filter_: Literal["linear", "nearest"],
) -> moderngl.Texture:
    """`upload` for an image file."""
    with Image.open(path) as image:
        return upload(context, image, wrap_u, wrap_v, filter_)
