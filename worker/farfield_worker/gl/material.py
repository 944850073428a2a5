"""Materials as GLSL: what a fragment of a batch looks like, by the light model of `shading/`.

`surface_glsl` is the part that all programs share: bake, shoot, and the pyrender way of baking. It
expects the varyings `v_uv`, `v_normal` and `v_color` (linear) and offers

    vec3 surface(vec2 pixel)    sRGB colour; discards where the material draws nothing at `pixel`
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import farfield_shading as shading
from farfield_core.scene import Batch


class Features(NamedTuple):
    """What distinguishes the programs of two materials."""

    textured: bool
    emissive_textured: bool
    alpha: Literal["opaque", "mask", "dither"]
    double_sided: bool
    unlit: bool

    @classmethod
    def of(cls, batch: Batch) -> Features:
        """Features of a prepared scene's batch."""
        return cls(
            batch.texture is not None,
            batch.emissive_texture is not None,
            batch.alpha,
            batch.double_sided,
            batch.unlit,
        )

    @property
    def defines(self) -> str:
        """`#define` lines that select these features in `surface_glsl`."""
        names = {
            "TEXTURED": self.textured,
            "EMISSIVE_TEXTURED": self.emissive_textured,
            "ALPHA_MASK": self.alpha == "mask",
            "ALPHA_DITHER": self.alpha == "dither",
            "DOUBLE_SIDED": self.double_sided,
            "UNLIT": self.unlit,
        }
        return "".join(f"#define {name}\n" for name, on in names.items() if on)


_SURFACE = """
uniform sampler2D base_texture;
uniform sampler2D emissive_texture;
uniform vec3 emissive_factor;
uniform float cutoff;

in vec2 v_uv;
in vec3 v_normal;
in vec4 v_color;

vec3 surface(vec2 pixel) {
  vec4 base = v_color;
#ifdef TEXTURED
  base *= texture(base_texture, v_uv);
#endif
  vec3 emissive = emissive_factor;
#ifdef EMISSIVE_TEXTURED
  emissive *= texture(emissive_texture, v_uv).rgb;
#endif
#ifdef ALPHA_MASK
  if (base.a < cutoff) discard;
#endif
#ifdef ALPHA_DITHER
  if (!ff_dither(base.a, pixel)) discard;
#endif
  vec3 normal = normalize(v_normal);
#ifdef DOUBLE_SIDED
  if (!gl_FrontFacing) normal = -normal;
#endif
#ifdef UNLIT
  float unlit = 1.0;
#else
  float unlit = 0.0;
#endif
  return ff_to_srgb(ff_shade(base.rgb, normal, emissive, unlit));
}
"""


def surface_glsl(features: Features) -> str:
    """GLSL 3.30 text of `surface` for materials with `features`, the light model included."""
    return features.defines + shading.glsl() + _SURFACE
