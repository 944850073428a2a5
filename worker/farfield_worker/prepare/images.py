"""Textures: measured before they are decoded, decoded by Pillow, told apart by their content."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from farfield_worker.prepare.limits import Limits, refuse

#: the formats a texture may have; Pillow knows many more, some of them old and fragile
FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF")


class UnreadablePictureError(Exception):
    """The bytes are no picture that Pillow reads; the caller notes it and goes on."""


@dataclass(frozen=True, eq=False)
class Picture:
    """One texture.

    Attributes:
        name: what the model calls it, for notes.
        data: the encoded bytes, or the file that holds them.
        opacity: a second picture whose brightness is this one's opacity (OBJ's map_d).
    """

    name: str
    data: bytes | Path
    opacity: Picture | None = None

    @cached_property
    def pixels(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8, sRGB with straight alpha; raises UnreadablePictureError."""
        rgba = np.asarray(_decode(self.data))
        if self.opacity is not None:
            mask = _decode(self.opacity.data).convert("L")
            size = (rgba.shape[1], rgba.shape[0])
            rgba = rgba.copy()
            rgba[..., 3] = np.asarray(mask if mask.size == size else mask.resize(size))
        return rgba

    def forget(self) -> None:
        """Drop the decoded pixels."""
        self.__dict__.pop("pixels", None)


def measure(picture: Picture, model: str, limits: Limits) -> int:
    """Pixels of `picture`, from its header alone.

    Raises UnreadablePictureError, or SceneRefusedError if there are more than `limits.pixels`.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(_stream(picture.data), formats=FORMATS) as image:
                width, height = image.size
    except Image.DecompressionBombError:
        refuse(model, f"its texture {picture.name!r} is far too large; reduce it")
    except Exception as error:  # Pillow's decoders raise almost anything on damaged files
        raise UnreadablePictureError(str(error)) from None
    if width * height > limits.pixels:
        refuse(model, f"its texture {picture.name!r} has {width} x {height} pixels; reduce it")
    return width * height


def _stream(data: bytes | Path) -> io.BytesIO | Path:
    return data if isinstance(data, Path) else io.BytesIO(data)


def _decode(data: bytes | Path) -> Image.Image:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # measure() has decided about the size already
            with Image.open(_stream(data), formats=FORMATS) as image:
                if image.mode.startswith("I") or image.mode == "F":
                    # 16-bit greys: Pillow would clip instead of scaling
                    grey = np.asarray(image, np.float64)
                    return Image.fromarray(np.clip(grey / 257, 0, 255).astype(np.uint8)).convert(
                        "RGBA"
                    )
                return image.convert("RGBA")
    except MemoryError:
        raise
    except Exception as error:  # as in measure()
        raise UnreadablePictureError(str(error)) from None


def encode_png(pixels: NDArray[np.uint8]) -> bytes:
    """PNG file of (h, w, 3) or (h, w, 4) uint8 pixels."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG", compress_level=4)
    return out.getvalue()


def shrink(pixels: NDArray[np.uint8], longest: int) -> NDArray[np.uint8]:
    """Pixels (h, w, 3|4) averaged down until no side exceeds `longest`.

    Colours weigh by opacity; where all is transparent they are averaged as they are, so that
    sampling between texels finds no black.
    """
    height, width = pixels.shape[:2]
    scale = longest / max(height, width)
    if scale >= 1:
        return pixels
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small = np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BOX))
    if pixels.shape[2] == 3:
        return small
    plain = Image.fromarray(pixels[..., :3].copy()).resize(size, Image.Resampling.BOX)
    color = np.where(small[..., 3:] > 0, small[..., :3], np.asarray(plain))
    return np.concatenate([color, small[..., 3:]], axis=-1)
