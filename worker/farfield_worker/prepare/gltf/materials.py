"""glTF materials (specification, section 3.9), reduced to what a diffuse light model shows."""

from __future__ import annotations

from typing import Any, Literal

from farfield_worker.prepare.gltf.document import Json
from farfield_worker.prepare.gltf.textures import Textures
from farfield_worker.prepare.model import Material

_MODES: dict[Any, Literal["opaque", "mask", "blend"]] = {"MASK": "mask", "BLEND": "blend"}


def read_materials(textures: Textures) -> list[Material]:
    """All materials of the document, and glTF's default material as the last."""
    document = textures.document
    count = len(document.json.get("materials", []))
    return [_material(textures, document.item("materials", index)) for index in range(count)] + [
        Material("default")
    ]


def _material(textures: Textures, entry: Json) -> Material:
    extensions = entry.get("extensions", {})
    surface = entry.get("pbrMetallicRoughness", {})
    base, factor = surface.get("baseColorTexture"), surface.get("baseColorFactor", (1, 1, 1, 1))
    older = extensions.get("KHR_materials_pbrSpecularGlossiness")
    if older is not None:
        base, factor = older.get("diffuseTexture"), older.get("diffuseFactor", (1, 1, 1, 1))
    unlit = "KHR_materials_unlit" in extensions
    strength = float(
        extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
    )
    r, g, b, a = (_unit(x) for x in factor)
    glow = [max(0.0, float(x)) * strength for x in entry.get("emissiveFactor", (0, 0, 0))]
    lit = not unlit and any(x > 0 for x in glow)
    return Material(
        str(entry.get("name", "")),
        textures.use(base),
        (r, g, b, a),
        (glow[0], glow[1], glow[2]) if lit else (0.0, 0.0, 0.0),
        textures.use(entry.get("emissiveTexture")) if lit else None,
        _MODES.get(entry.get("alphaMode"), "opaque"),
        float(entry.get("alphaCutoff", 0.5)),
        bool(entry.get("doubleSided", False)),
        unlit,
    )


def _unit(x: Any) -> float:
    return min(max(float(x), 0.0), 1.0)
