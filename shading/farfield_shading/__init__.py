"""The one light model of Farfield: GLSL text, its constants, and the same mathematics in NumPy.

The GLSL (`glsl()`) is what the baker, `farfield shoot` and the viewer compile; the NumPy functions
are its slow, obvious twin that tests hold it against.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import cast

import numpy as np
from numpy.typing import NDArray

Light = dict[str, list[float]]
Colors = NDArray[np.float64]

LIGHT_NAMES = (
    "ambient",
    "sun_direction",
    "sun",
    "hemisphere_up",
    "hemisphere_down",
    "sky_zenith",
    "sky_horizon",
    "sky_ground",
)


@cache
def glsl() -> str:
    """The shading functions as GLSL text, without a `#version` line."""
    return files(__name__).joinpath("light.glsl").read_text(encoding="utf-8")


def default_light() -> Light:
    """Return the constants of light.json: linear RGB triples and one unit vector."""
    text = files(__name__).joinpath("light.json").read_text(encoding="utf-8")
    return cast(Light, json.loads(text))


def uniforms(light: Light) -> dict[str, tuple[float, float, float]]:
    """Return `light` keyed by the uniform names of light.glsl."""
    return {f"ff_{name}": (light[name][0], light[name][1], light[name][2]) for name in LIGHT_NAMES}


def irradiance(light: Light, normals: Colors) -> Colors:
    """Light on surfaces with unit `normals`, (..., 3) float -> (..., 3) float, linear."""
    n = np.asarray(normals, np.float64)
    lambert = np.maximum(n @ np.asarray(light["sun_direction"]), 0.0)[..., None]
    up = (0.5 + 0.5 * n[..., 1])[..., None]
    down_color, up_color = np.asarray(light["hemisphere_down"]), np.asarray(light["hemisphere_up"])
    return cast(
        Colors,
        np.asarray(light["ambient"])
        + np.asarray(light["sun"]) * lambert
        + down_color * (1.0 - up)
        + up_color * up,
    )


def shade(
    light: Light, base: Colors, normals: Colors, emissive: Colors, unlit: bool = False
) -> Colors:
    """Linear colour of a surface, (..., 3) float in [0, 1]; all arguments (..., 3), linear."""
    b = np.asarray(base, np.float64)
    lit = b if unlit else b * irradiance(light, normals) + np.asarray(emissive)
    return cast(Colors, np.clip(lit, 0.0, 1.0))


def to_srgb(linear: Colors) -> Colors:
    """IEC 61966-2-1 transfer function, linear -> sRGB, (...) float in [0, 1]."""
    c = np.asarray(linear, np.float64)
    return np.where(c < 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 0.0031308) ** (1 / 2.4) - 0.055)


def to_linear(srgb: Colors) -> Colors:
    """IEC 61966-2-1 transfer function, sRGB -> linear, (...) float in [0, 1]."""
    c = np.asarray(srgb, np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((np.maximum(c, 0.04045) + 0.055) / 1.055) ** 2.4)


def sky(light: Light, directions: Colors) -> Colors:
    """Linear background colour seen along `directions`, (..., 3) float of any length."""
    v = np.asarray(directions, np.float64)
    y = (v[..., 1] / np.linalg.norm(v, axis=-1))[..., None]
    horizon = np.asarray(light["sky_horizon"])
    far = np.where(y >= 0.0, np.asarray(light["sky_zenith"]), np.asarray(light["sky_ground"]))
    return cast(Colors, horizon + (far - horizon) * np.sqrt(np.abs(y)))


def dither(alpha: Colors, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a sample of opacity `alpha` draws pixel (x, y): Bayer's 4x4 ordered dither."""
    rank = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
    return cast(
        NDArray[np.bool_],
        np.asarray(alpha) > (rank[np.asarray(y) & 3, np.asarray(x) & 3] + 0.5) / 16,
    )
