"""Wavefront material files, with the habits of the three.js reader.

Kd and Ke are sRGB; d or Tr give opacity, map_d a picture of it. A texture with transparent texels,
or map_d, makes the material a blended one.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from farfield_shading import to_linear

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.images import Picture, UnreadablePictureError, measure
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.model import Material, TextureUse

#: options of a map line -> how many values follow them
_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-texres": 1, "-clamp": 1, "-bm": 1,
    "-imfchan": 1, "-type": 1, "-cc": 1,
}  # fmt: skip
_VECTORS = ("-o", "-s", "-t")

WHITE = Material("white", double_sided=True)


class MaterialFile:
    """Reads .mtl files beside a model; what is missing becomes a note."""

    def __init__(self, folder: ModelFolder, limits: Limits, notes: list[str]) -> None:
        self.folder, self.limits, self.notes = folder, limits, notes
        self.materials: dict[str, Material] = {}
        self._uses: dict[tuple[str, str | None], TextureUse | None] = {}
        self._missing: list[str] = []
        self._pixels = 0

    def read(self, reference: str) -> None:
        """Add the materials of one file."""
        path = self.folder.find(reference, is_uri=False)
        if path is None:
            self.notes.append(f"The material file {reference[:80]!r} is missing.")
            return
        lines: dict[str, list[str]] = {}
        name = None
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            words = line.split()
            if len(words) < 2 or words[0].startswith("#"):
                continue
            if words[0] == "newmtl":
                self._finish(name, lines)
                name, lines = " ".join(words[1:]), {}
            else:
                lines[words[0].lower()] = words[1:]
        self._finish(name, lines)

    def close(self) -> None:
        """Write the note about textures that were not there."""
        if self._missing:
            few = ", ".join(repr(name) for name in self._missing[:3])
            more = f" and {len(self._missing) - 3} more" if len(self._missing) > 3 else ""
            self.notes.append(f"Textures are missing: {few}{more}.")

    def _finish(self, name: str | None, lines: dict[str, list[str]]) -> None:
        if name is None:
            return
        opacity = 1.0
        if "d" in lines:
            opacity = _number(lines["d"][-1], 1.0)
        elif "tr" in lines:
            opacity = 1.0 - _number(lines["tr"][-1], 0.0)
        base = self._texture(lines.get("map_kd"), lines.get("map_d"))
        r, g, b = _color(lines.get("kd"), 1.0)
        glow = _color(lines.get("ke"), 0.0)
        emissive_texture = self._texture(lines.get("map_ke"), None)
        if emissive_texture is not None and not any(glow):
            glow = (1.0, 1.0, 1.0)
        material = Material(
            name,
            base,
            (r, g, b, min(max(opacity, 0.0), 1.0)),
            glow,
            emissive_texture,
            double_sided=True,
        )
        self.materials[name] = replace(material, alpha=_alpha_mode(material))

    def _texture(self, words: list[str] | None, mask: list[str] | None) -> TextureUse | None:
        if words is None:
            return None
        file, options = split_options(words)
        mask_file = split_options(mask)[0] if mask is not None else None
        if mask_file == file:
            mask_file = None  # the opacity channel of the same picture
        key = (" ".join(words), mask_file)
        if key not in self._uses:
            picture = self._picture(file)
            if picture is not None and mask_file is not None:
                picture = replace(picture, opacity=self._picture(mask_file))
            self._uses[key] = None if picture is None else _use(picture, options)
        return self._uses[key]

    def _picture(self, file: str) -> Picture | None:
        path = self.folder.find(file, is_uri=False)
        if path is None:
            if file not in self._missing:
                self._missing.append(file)
            return None
        picture = Picture(file[:80], Path(path))
        try:
            self._pixels += measure(picture, self.folder.name, self.limits)
        except UnreadablePictureError:
            self.notes.append(f"The texture {file[:80]!r} cannot be read.")
            return None
        if self._pixels > self.limits.picture_pixels:
            refuse(self.folder.name, "its textures have too many pixels; reduce them")
        return picture


def split_options(words: list[str]) -> tuple[str, dict[str, list[str]]]:
    """Split a map line's words into file name and options, `-s 2 2 1 brick.png`."""
    options: dict[str, list[str]] = {}
    k = 0
    while k < len(words) - 1 and (words[k] in _OPTIONS or words[k] in _VECTORS):
        start = k + 1
        if words[k] in _VECTORS:
            stop = start
            while stop < min(start + 3, len(words) - 1) and _is_number(words[stop]):
                stop += 1
        else:
            stop = start + _OPTIONS[words[k]]
        options[words[k]] = words[start:stop]
        k = stop
    return " ".join(words[k:]), options


def _use(picture: Picture, options: dict[str, list[str]]) -> TextureUse:
    su, sv = _pair(options.get("-s"), 1.0)
    du, dv = _pair(options.get("-o"), 0.0)
    # written for v up: v' = sv v + dv; ours runs down: 1 - v' = sv (1 - v) + 1 - sv - dv
    transform = ((su, 0.0, du), (0.0, sv, 1.0 - sv - dv))
    moved = (su, sv, du, dv) != (1.0, 1.0, 0.0, 0.0)
    if options.get("-clamp") == ["on"]:
        return TextureUse(picture, "clamp", "clamp", transform=transform if moved else None)
    return TextureUse(picture, transform=transform if moved else None)


def _alpha_mode(material: Material) -> Literal["opaque", "blend"]:
    if material.factor[3] < 1:
        return "blend"
    if material.base is None:
        return "opaque"
    try:
        return "blend" if material.base.picture.pixels[..., 3].min() < 255 else "opaque"
    except UnreadablePictureError:
        return "opaque"
    finally:
        material.base.picture.forget()


def _pair(words: list[str] | None, rest: float) -> tuple[float, float]:
    values = [_number(word, rest) for word in words or []] + [rest, rest]
    return values[0], values[1]


def _color(words: list[str] | None, rest: float) -> tuple[float, float, float]:
    if words is None or not all(_is_number(word) for word in words):
        return (rest, rest, rest)
    values = np.array([float(word) for word in words[:3]])
    if len(values) < 3:
        values = np.repeat(values[:1], 3)
    r, g, b = to_linear(np.clip(values, 0, 1)).tolist()
    return (r, g, b)


def _number(word: str, rest: float) -> float:
    return float(word) if _is_number(word) else rest


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False
