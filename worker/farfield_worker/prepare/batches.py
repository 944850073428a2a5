"""Materials sorted into draw states, and textures written once each.

Base colour factors go into vertex colours, so materials that differ only in them share a batch.
Opacity is decided here (farfield_core.scene.Batch): a mode that can make no difference is dropped.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from farfield_core.scene import Batch, Texture

from farfield_worker.prepare.images import UnreadablePictureError, encode_png, shrink
from farfield_worker.prepare.model import Material, Mesh, Model, TextureUse

#: longest side of a stored texture; larger ones are reduced
LARGEST_TEXTURE = 8192
#: opacity counts as even (glass) if the least is at least this share of the greatest: a mask at
#: half the greatest would cut nothing
EVEN = 0.5

_OPAQUE = 254.5 / 255


@dataclass(frozen=True)
class Look:
    """How a mesh draws: its batch (-1: not at all) and what its colours are multiplied by."""

    batch: int
    factor: tuple[float, float, float, float]
    textured: bool


@dataclass
class TextureFiles:
    """Writes pictures into `folder` as PNG files named by content."""

    folder: Path
    notes: list[str]
    entries: list[Texture] = field(default_factory=list)
    _written: dict[tuple[int, bool], tuple[str, int, int] | None] = field(default_factory=dict)
    _opacity: dict[int, tuple[float, float]] = field(default_factory=dict)

    def add(self, use: TextureUse, keep_alpha: bool) -> int | None:
        """Index of a texture in `entries`; None, with a note, if it cannot be read."""
        key = (id(use.picture), keep_alpha)
        if key not in self._written:
            self._written[key] = self._write(use, keep_alpha)
        written = self._written[key]
        if written is None:
            return None
        name, width, height = written
        entry = Texture(
            file=name,
            width=width,
            height=height,
            wrap_u=use.wrap_u,
            wrap_v=use.wrap_v,
            filter=use.filter,
        )
        if entry not in self.entries:
            self.entries.append(entry)
        return self.entries.index(entry)

    def opacity(self, use: TextureUse) -> tuple[float, float]:
        """Least and greatest opacity in a picture; (1, 1) if it cannot be read."""
        key = id(use.picture)
        if key not in self._opacity:
            try:
                alpha = use.picture.pixels[..., 3]
                self._opacity[key] = (int(alpha.min()) / 255, int(alpha.max()) / 255)
            except UnreadablePictureError:
                self._opacity[key] = (1.0, 1.0)
        return self._opacity[key]

    def _write(self, use: TextureUse, keep_alpha: bool) -> tuple[str, int, int] | None:
        try:
            pixels = use.picture.pixels
        except UnreadablePictureError:
            self.notes.append(f"The texture {use.picture.name!r} cannot be read.")
            return None
        if not keep_alpha:
            pixels = pixels[..., :3].copy()
        pixels = shrink(pixels, LARGEST_TEXTURE)
        use.picture.forget()
        data = encode_png(pixels)
        name = hashlib.sha256(data).hexdigest()[:32] + ".png"
        path = self.folder / name
        if not path.exists():
            path.write_bytes(data)
        return name, pixels.shape[1], pixels.shape[0]


def sort_into_batches(model: Model, files: TextureFiles) -> tuple[list[Batch], list[Look]]:
    """Batches of a model, and the look of each mesh."""
    batches: dict[Batch, int] = {}
    looks: list[Look] = []
    known: dict[tuple[int, bool, float, float], Look] = {}
    for mesh in model.meshes:
        low, high = _alpha_range(mesh)
        key = (mesh.material, mesh.uvs is not None, low, high)
        if key not in known:
            known[key] = _look(model, model.materials[mesh.material], key, files, batches)
        looks.append(known[key])
    if any(look.batch < 0 for look in looks):
        model.notes.append("Parts that are wholly transparent were left out.")
    return list(batches), looks


def _alpha_range(mesh: Mesh) -> tuple[float, float]:
    if mesh.colors is None or len(mesh.colors) == 0:
        return 1.0, 1.0
    alpha = mesh.colors[:, 3]
    return int(alpha.min()) / 65535, int(alpha.max()) / 65535


def _look(
    model: Model,
    material: Material,
    key: tuple[int, bool, float, float],
    files: TextureFiles,
    batches: dict[Batch, int],
) -> Look:
    _, has_uvs, low, high = key
    base = material.base if has_uvs else None
    if material.base is not None and not has_uvs:
        _note(model, "A part without texture coordinates lost its texture.")
    if base is not None:
        least, greatest = files.opacity(base)
        low, high = low * least, high * greatest
    low, high = low * material.factor[3], high * material.factor[3]
    alpha, cutoff = decide_opacity(material.alpha, material.cutoff, low, high)
    if alpha is None:
        return Look(-1, material.factor, False)
    texture = None if base is None else files.add(base, keep_alpha=alpha != "opaque")
    emissive, emissive_texture = _emission(model, material, has_uvs, files)
    batch = Batch(
        texture=texture,
        emissive=emissive,
        emissive_texture=emissive_texture,
        alpha=alpha,
        cutoff=cutoff,
        double_sided=material.double_sided,
        unlit=material.unlit,
    )
    index = batches.setdefault(batch, len(batches))
    r, g, b, a = material.factor
    textured = texture is not None or emissive_texture is not None
    return Look(index, (r, g, b, 1.0 if alpha == "opaque" else a), textured)


def decide_opacity(
    mode: Literal["opaque", "mask", "blend"], cutoff: float, low: float, high: float
) -> tuple[Literal["opaque", "mask", "dither"] | None, float]:
    """How opacities in [low, high] are drawn, and the cutoff; None: nothing would show."""
    if mode == "opaque":
        return "opaque", 0.5
    if mode == "mask":
        if low >= cutoff:
            return "opaque", 0.5
        return ("mask", cutoff) if high >= cutoff else (None, 0.5)
    if low >= _OPAQUE:
        return "opaque", 0.5
    if high <= 0:
        return None, 0.5
    return ("dither", 0.5) if low >= EVEN * high else ("mask", high / 2)


def _emission(
    model: Model, material: Material, has_uvs: bool, files: TextureFiles
) -> tuple[tuple[float, float, float], int | None]:
    use = material.emissive_texture
    if use is None or material.emissive == (0.0, 0.0, 0.0):
        return material.emissive, None
    base = material.base
    fits = base is None or (base.texcoord, base.transform) == (use.texcoord, use.transform)
    index = files.add(use, keep_alpha=False) if has_uvs and fits else None
    if index is None:
        # the factor alone would make the whole surface shine
        _note(model, "An emissive texture could not be used; that surface does not shine.")
        return (0.0, 0.0, 0.0), None
    return material.emissive, index


def _note(model: Model, text: str) -> None:
    if text not in model.notes:
        model.notes.append(text)
